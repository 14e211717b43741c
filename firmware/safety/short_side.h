/* SPDX-License-Identifier: Apache-2.0 */
#ifndef SAFETY_SHORT_SIDE_H
#define SAFETY_SHORT_SIDE_H
/** The side of the bridge by which a short circuit would be made: the side whose switches all conduct.
 *   m_x: first-order mean, over 32 samples, of the deviation of phase current x from its reference. The means are kept
 *     during the short circuit, whose currents have a decaying constant part of their own.
 *   Upper switches if the m_x of the largest magnitude is positive and above i_min: in a phase whose lower switch does
 *     not switch on, or whose upper switch is shorted, the mean current flows out of the bridge.
 *   Lower switches otherwise; in an intact bridge either side is suitable.
 * Source   docs/theory/safe-state.md (SS-20)
 * Units    per unit
 * Range    every argument
 * Rounding 2^-8 of a count
 * Errors   none
 * Context  1 kHz task; no division */
#include <stdbool.h>
#include <stdint.h>

#include "fx/q.h"
#include "types/frames.h"

typedef struct {
    int32_t a_q8, b_q8; /* means; that of c follows from the sum */
} short_side_state_t;

typedef struct {
    bool acting;  /* the bridge follows its references */
    bool shorted; /* the means are kept; neither acting nor shorted: they start from 0 again */
    abc_q15_t i, i_ref;
} short_side_in_t;

void short_side_step(short_side_state_t *state, const short_side_in_t *in);

/** Whether a short circuit would be made by the upper switches; i_min: smaller means are not significant. */
bool short_side_is_upper(const short_side_state_t *state, q15_t i_min);

#endif
