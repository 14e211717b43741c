/* SPDX-License-Identifier: Apache-2.0 */
#include "safety/safe_state.h"

#define SQRT3 113512 /* Q15.16 */

bool safe_state_step(const safe_state_config_t *config, safe_state_state_t *state, const safe_state_in_t *in)
{
    if (in->speed_valid) {
        state->speed = fx_abs_q15(in->omega);
    }
    const q15_t psi = fx_sat_q15(config->psi_f + fx_max_s32(in->psi_delta, 0));
    const q15_t line_emf = fx_mul_gain_q15(SQRT3, fx_mul_q15(state->speed, psi));
    const bool lower_level = state->short_circuit || !in->speed_valid;
    const q15_t share = lower_level ? config->share_open : config->share_short;
    const bool rectifies = line_emf > fx_mul_q15(share, in->v_dc);
    state->short_circuit = rectifies;
    return rectifies || (in->over_voltage && in->v_dc > config->v_release);
}
