/* SPDX-License-Identifier: Apache-2.0 */
#include "safety/open_switch.h"

#include "fx/format.h"

#define TURN_Q16 65535U
#define SIGNIFICANT 2      /* times i_min */

static int32_t largest_of(abc_q15_t x)
{
    return fx_max_s32(fx_max_s32(x.a, x.b), x.c);
}

static int32_t smallest_of(abc_q15_t x)
{
    return fx_min_s32(fx_min_s32(x.a, x.b), x.c);
}

static uint16_t larger_angle(uint16_t angle_q16, uint32_t step_q16)
{
    const uint32_t sum = angle_q16 + step_q16;
    return (uint16_t)((sum < TURN_Q16) ? sum : TURN_Q16);
}

/* The flux that voltages have added. */
static void add_flux(open_switch_state_t *state, const open_switch_in_t *in, bool in_range, uint32_t step_q16)
{
    if (!in_range || !state->has_before || state->turned_q16 >= TURN_Q16) {
        state->sum_alpha = 0;
        state->sum_beta = 0;
        state->turned_q16 = 0;
    } else {
        state->sum_alpha = fx_sat_q15(state->sum_alpha + in->psi.alpha - state->before_alpha);
        state->sum_beta = fx_sat_q15(state->sum_beta + in->psi.beta - state->before_beta);
        state->turned_q16 = larger_angle(state->turned_q16, step_q16);
    }
    state->has_before = in_range;
    state->before_alpha = fx_sat_q15(in->psi.alpha);
    state->before_beta = fx_sat_q15(in->psi.beta);
}

static open_switch_t shown_by_flux(const open_switch_config_t *config, const open_switch_state_t *state)
{
    const int32_t side = fx_mul_q15(state->sum_beta, Q15(SQRT3_HALF));
    const int32_t b = side - (state->sum_alpha >> 1);
    const abc_q15_t s = {state->sum_alpha, b, b - 2 * side};
    const int32_t highest = largest_of(s);
    const int32_t lowest = smallest_of(s);
    if (fx_max_s32(highest, -lowest) <= config->psi_min) {
        return OPEN_SWITCH_NONE;
    }
    return (highest > -lowest) ? OPEN_SWITCH_LOWER : OPEN_SWITCH_UPPER;
}

static bool is_one_sided(open_switch_state_t *state, const open_switch_in_t *in, int32_t i_min, uint32_t step_q16)
{
    const int32_t out[3] = {in->i.a, in->i.b, in->i.c};
    bool found = false;
    for (int x = 0; x < 3; x++) {
        const int32_t through_diode = in->upper ? -out[x] : out[x];
        state->one_sided_q16[x] = (through_diode < -i_min) ? 0U : larger_angle(state->one_sided_q16[x], step_q16);
        found = found || state->one_sided_q16[x] >= TURN_Q16;
    }
    return found;
}

open_switch_t open_switch_step(const open_switch_config_t *config, open_switch_state_t *state,
                               const open_switch_in_t *in)
{
    const int32_t largest = fx_max_s32(largest_of(in->i), -smallest_of(in->i));
    const uint32_t step_q16 = (uint32_t)fx_abs_q31(in->angle_step) >> 16;
    const bool plausible = fx_abs_q31(in->i.a + in->i.b + in->i.c) <= config->sum_max;
    add_flux(state, in, plausible && largest <= config->i_max, step_q16);
    const open_switch_t by_flux = shown_by_flux(config, state);
    if (!plausible || by_flux != OPEN_SWITCH_NONE) {
        return by_flux;
    }
    if (!is_one_sided(state, in, config->i_min, (largest < SIGNIFICANT * config->i_min) ? 0U : step_q16)) {
        return OPEN_SWITCH_NONE;
    }
    return in->upper ? OPEN_SWITCH_UPPER : OPEN_SWITCH_LOWER;
}
