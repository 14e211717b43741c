/* SPDX-License-Identifier: Apache-2.0 */
#ifndef SAFETY_GAIN_JUMP_H
#define SAFETY_GAIN_JUMP_H
/** Finds current sensors whose common gain jumps: the readings return to their references, the voltages do not.
 *   candidate  |(i_mean - i*).i*| > |i| i_0/4, |i| > 4 i_0
 *   change     u = mean of the residual in the 7th to 22nd step from it - mean over 16 steps before
 *   of sensors |u.D| > |D|^2/16, 3 |u x D| < |u.D| < 3/4 |D|^2, D = d u/d ln|i|;  |u| > (v_0 + v_noise)/12
 *   The residual e - j w psi(i) of the tables at the measured current does not change with reference and speed, as far
 *   as the tables are right. Since the mean before, i* must have moved by less than 1/16 in each of the 33 steps up to
 *   the candidate and by less than a quarter until the decision, the speed by less than 1/64 and lag_noise; otherwise
 *   the comparison begins anew, and so it does with a candidate before the 33rd step.
 * Source   docs/theory/monitors.md (MN-58) ... (MN-61)
 * Units    per unit
 * Range    every argument
 * Rounding 1 LSB q15 of each component of u, 2 LSB are added to its threshold; 16 LSB of reference and speed before
 * Errors   none
 * Context  1 kHz task; no division */
#include <stdbool.h>
#include <stdint.h>

#include "safety/torque_types.h"
#include "types/frames.h"

typedef struct {
    dq_q15_halfword_t residual; /* of the voltages, mean of the step before the last */
    fx_pair_t i_ref, i_excess;  /* in the last step: d, q of the reference; of the mean current beyond it */
    q15_t omega;                /* tracked */
    q15_t current;              /* magnitude of the sample */
} gain_jump_in_t;

typedef struct {
    /* Mean residual over 16 steps, times 16; from the 7th step after a candidate on each residual is subtracted. */
    dq_q15_t change_x16;
    dq_q15_halfword_t i_ref; /* means over 16 steps of reference and speed before */
    q15_t omega;
    uint8_t steps;
} gain_jump_state_t;

/** true: a candidate is to be decided in this step by gain_jump_is_found(). */
bool gain_jump_step(const torque_monitor_config_t *config, gain_jump_state_t *state, const gain_jump_in_t *in);
/** per_quarter: the part of the voltage that a quarter of the current makes, D/4. */
bool gain_jump_is_found(const torque_monitor_config_t *config, const gain_jump_state_t *state, dq_q15_t per_quarter);

#endif
