/* SPDX-License-Identifier: Apache-2.0 */
#ifndef SAFETY_CURRENT_JUMP_H
#define SAFETY_CURRENT_JUMP_H
/** Finds current sensors whose common gain jumps: the measured current jumps along itself from one sample to the next,
 * and stays there. The flux of a winding cannot jump, so that its current goes on changing, or turns back.
 *   D_k    = i_k - i_(k-1) in the rotor frame
 *   jump   |D_k| > 0.02 of full scale, > 2 |D| of all samples of this step before it and of the step before;
 *          |i_(k-1)|/16 < |D_k| < |i_(k-1)|/2, |D_k x i_(k-1)| < |D_k . i_(k-1)|/2
 *   stays  |D_(k+1)| < |D_k|/4: what current control answers to sample k acts after sample k+1 only
 * Source   docs/theory/monitors.md (MN-57), (MN-58)
 * Units    per unit of the full scale of the current converters
 * Range    every current
 * Rounding half a count of each component of D
 * Errors   none; the caller knows whether a voltage can have caused the jump
 * Context  1 kHz task; no division, no root */
#include <stdbool.h>
#include <stdint.h>

#include "types/frames.h"

#define CURRENT_JUMP_MIN 107374U /* (0.02/2)^2, Q30 */

/** (|D|/2)^2 of two samples in a row, Q30: at most 2^31 for components within 1. Halved, because the squares must fit
 * a word. */
static inline uint32_t current_jump_moved(dq_q15_t last, dq_q15_t now)
{
    const int32_t d = (now.d - last.d) >> 1, q = (now.q - last.q) >> 1;
    return (uint32_t)(d * d) + (uint32_t)(q * q);
}

/** Whether a change of this size can stand out where the changes before it were `before` at most. */
static inline bool current_jump_stands_out(uint32_t moved, uint32_t before)
{
    return moved > CURRENT_JUMP_MIN && moved >> 2 > before;
}

/** Whether the change from `last` to `i` is along the current, is neither too small nor too large for a gain, and
 * stays in the next sample. */
bool current_jump_is_of_gain(dq_q15_t last, dq_q15_t i, dq_q15_t next);

#endif
