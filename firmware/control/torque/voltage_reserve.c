/* SPDX-License-Identifier: Apache-2.0 */
#include "control/torque/voltage_reserve.h"

#include "fx/q.h"
#include "fx/vec.h"

/* The references are at the flux limit when their flux exceeds 31/32 of the planned flux: errors of rounding and
 * interpolation are smaller than 1/32, and a maximum-torque-per-ampere point away from the limit has less flux. */
#define ON_LIMIT_SHIFT 5

voltage_reserve_t voltage_reserve_step(const voltage_reserve_config_t *config, voltage_reserve_state_t *state,
                                       const voltage_reserve_in_t *in)
{
    const int32_t psi = fx_magnitude(in->psi.d, in->psi.q);
    const int32_t with_magnet = fx_magnitude(fx_sat_q15_word(in->psi.d + in->psi_d_error), in->psi.q);
    const int32_t planned = fx_mul_q15(config->v_ratio, in->v_dc);
    const int32_t reserve = planned - in->u;
    const bool on_limit = psi > in->psi_plan - (in->psi_plan >> ON_LIMIT_SHIFT);

    int32_t error = -fx_q15_from_q31(state->trim);
    if (in->acting && (reserve < 0 || on_limit)) {
        error = reserve;
    }
    /* Q15 * Q15 = Q30, twice: Q31. */
    const q31_t moved = fx_add2_q31(state->trim, config->gain * fx_sat_q15_word(error));
    const q31_t trim_max = 2 * config->trim_max * in->v_dc;
    state->trim = fx_clamp_q31(moved, fx_q31_from_q15(config->trim_min), trim_max);
    return (voltage_reserve_t){
        .v_plan = planned + fx_q15_from_q31(state->trim),
        .shift = with_magnet - psi,
    };
}
