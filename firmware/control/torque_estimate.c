/* SPDX-License-Identifier: Apache-2.0 */
#include "control/torque_estimate.h"

#include "fx/q.h"

/* 2^32/N: the mean without a division, exact to its rounding for |sum| <= 10 2^15. */
#define PER_COUNT ((int32_t)(4294967296LL / TORQUE_ESTIMATE_PERIODS))

q15_t torque_estimate_step(torque_estimate_state_t *state, dq_t i, const flux_point_t *flux, q31_t psi_delta)
{
    const int32_t psi_d = fx_sat_q15_word(flux->psi_d + fx_q15_from_q31(psi_delta));
    const q15_t t = fx_round_q15(fx_sub_q31(psi_d * i.q, flux->psi_q * i.d));

    state->sum += t;
    state->count++;
    if (state->count >= TORQUE_ESTIMATE_PERIODS) {
        state->mean = fx_sat_q15(fx_mulhi(state->sum, PER_COUNT));
        state->sum = 0;
        state->count = 0;
    }
    return t;
}
