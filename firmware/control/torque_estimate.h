/* SPDX-License-Identifier: Apache-2.0 */
#ifndef CONTROL_TORQUE_ESTIMATE_H
#define CONTROL_TORQUE_ESTIMATE_H
/** Air-gap torque from currents, tables and identified flux, averaged over one task period.
 *   t = (psi_d + dpsi) i_q - psi_q i_d;  every N periods T^ = mean of the last N
 * Source   docs/theory/torque-loop.md (TL-1), (TL-2); the 2014 paper, section 3
 * Units    per unit of T_b = 1.5 p psi_b I_b: no constant
 * Range    |t| < 1
 * Rounding half up, 1/2 LSB q15 in t, 1/2 LSB q15 in the mean
 * Errors   saturates
 * Context  MRAI ISR; the mean is one aligned 16-bit word: readers below need no lock */
#include "control/flux_table_types.h"
#include "types/frames.h"

/** Periods of one mean, and of one step of the slow task. */
#define TORQUE_ESTIMATE_PERIODS 10

typedef struct {
    int32_t sum;
    int32_t count;
    q15_t mean;
} torque_estimate_state_t;

q15_t torque_estimate_step(torque_estimate_state_t *state, dq_t i, const flux_point_t *flux, q31_t psi_delta);

#endif
