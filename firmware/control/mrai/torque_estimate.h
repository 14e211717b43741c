/* SPDX-License-Identifier: Apache-2.0 */
#ifndef MRAI_TORQUE_ESTIMATE_H
#define MRAI_TORQUE_ESTIMATE_H
/** Air-gap torque from currents, tables and identified flux, averaged over one task period.
 *   t = (psi_d + dpsi) i_q - psi_q i_d, summed in each period;  T^ = mean over the periods since the last mean
 * Source   docs/theory/torque-loop.md (TL-1), (TL-2); the 2014 paper, section 3
 * Units    per unit of T_b = 1.5 p psi_b I_b: no constant
 * Range    |t| < 2; the sum wraps, its differences over up to 63 periods do not
 * Rounding psi_d + dpsi 1/2 LSB q15 (dpsi comes rounded), 1/2 LSB q15 in the mean, half up
 * Errors   the mean saturates; without a new period, or with more than 63, it keeps its last value
 * Context  torque_estimate_add(): MRAI ISR; torque_estimate_mean(): 1 kHz task, from a copy of both words */
#include "control/current/flux_table_types.h"
#include "types/frames.h"

/** Both count up and wrap. */
typedef struct {
    int32_t sum_q24;
    int32_t count; /* periods */
} torque_sum_t;

typedef struct {
    torque_sum_t last;
    q15_t mean;
} torque_mean_t;

/** psi_delta: q15. */
void torque_estimate_add(torque_sum_t *sum, const dq_q15_t *i, const flux_point_t *flux, int32_t psi_delta);
q15_t torque_estimate_mean(torque_mean_t *state, const torque_sum_t *sum);

#endif
