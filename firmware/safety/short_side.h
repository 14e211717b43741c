/* SPDX-License-Identifier: Apache-2.0 */
#ifndef SAFETY_SHORT_SIDE_H
#define SAFETY_SHORT_SIDE_H
/** The side of the bridge by which a short circuit would be made: the side whose switches all conduct.
 *   m_x: first-order mean, 16 steps, of the deviation of phase current x from its reference; kept in the short circuit,
 *   whose currents have a constant part of their own that decays
 *   upper switches if the largest |m_x| > i_least and that m_x > 0: a lower switch that does not switch on leaves its
 *   phase only the current out of the bridge, and so does an upper switch that is shorted
 *   lower switches otherwise; with a sound bridge either side will do
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
    bool shorted; /* the means are kept; with neither they begin anew */
    abc_q15_t i, i_ref;
} short_side_in_t;

void short_side_step(short_side_state_t *state, const short_side_in_t *in);

/** Whether a short circuit would be made by the upper switches; i_least: a smaller mean says nothing. */
bool short_side_is_upper(const short_side_state_t *state, q15_t i_least);

#endif
