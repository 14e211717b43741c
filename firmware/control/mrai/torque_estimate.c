/* SPDX-License-Identifier: Apache-2.0 */
#include "control/mrai/torque_estimate.h"

#include "fx/codegen.h"
#include "fx/q.h"

#define Q24_PER_Q15 512
/* The largest number of periods whose sum fits: |t| < 2 in Q24. */
#define PERIODS_MAX 63U

void torque_estimate_add(torque_sum_t *sum, const dq_q15_t *i, const flux_point_t *flux, int32_t psi_delta)
{
    const int32_t psi_d = fx_sat_q15_word(flux->psi_d + psi_delta);
    /* Q15 * Q15 = Q30. Cannot overflow: -1 * -1 is 2^30, and the product subtracted from it is above -2^30. */
    const int32_t t_q30 = psi_d * i->q - flux->psi_q * i->d;
    sum->sum_q24 = fx_add_wrap(sum->sum_q24, t_q30 >> 6);
    sum->count = fx_add_wrap(sum->count, 1);
}

/* Rounded half up for either sign. Each term of the sum was truncated, by half an LSB of Q24 on average, which count/2
 * restores. */
FX_COLD q15_t torque_estimate_mean(torque_mean_t *state, const torque_sum_t *sum)
{
    const uint32_t count = (uint32_t)sum->count - (uint32_t)state->last.count;
    const int32_t total_q24 = fx_sub_wrap(sum->sum_q24, state->last.sum_q24);
    state->last = *sum;
    if (count - 1U < PERIODS_MAX) {
        const int32_t unit = (int32_t)count * Q24_PER_Q15;
        const int32_t above = total_q24 + unit / 2 + (int32_t)count / 2;
        const int32_t quotient = above / unit;
        state->mean = fx_sat_q15((above % unit < 0) ? quotient - 1 : quotient);
    }
    return state->mean;
}
