/* SPDX-License-Identifier: Apache-2.0 */
#include "safety/open_switch.h"

#include "fx/format.h"

#define TURN_Q16 65535U
#define SIGNIFICANT 2 /* times i_min */

static uint16_t larger_angle(uint32_t angle_q16, uint32_t step_q16)
{
    const uint32_t sum = angle_q16 + step_q16;
    return (uint16_t)((sum < TURN_Q16) ? sum : TURN_Q16);
}

void open_switch_reset(open_switch_state_t *state)
{
    state->has_begun = false;
    state->one_sided_q16[0] = 0;
    state->one_sided_q16[1] = 0;
    state->one_sided_q16[2] = 0;
}

open_switch_t open_switch_by_flux(const open_switch_config_t *config, open_switch_state_t *state, ab_q15_t psi,
                                  int32_t i_squared_q30, uint32_t step_q16)
{
    const bool is_known = i_squared_q30 <= config->i_max * config->i_max;
    if (!is_known || !state->has_begun || state->turned_q16 >= TURN_Q16) {
        state->has_begun = is_known;
        state->turned_q16 = 0;
        state->begin_alpha = fx_sat_q15(psi.alpha);
        state->begin_beta = fx_sat_q15(psi.beta);
        return OPEN_SWITCH_NONE;
    }
    state->turned_q16 = larger_angle(state->turned_q16, step_q16);
    const int32_t added_alpha = psi.alpha - state->begin_alpha;
    const int32_t side = fx_mul_q15(fx_sat_q15(psi.beta - state->begin_beta), Q15(SQRT3_HALF));
    const int32_t b = side - (added_alpha >> 1);
    const abc_q15_t s = {added_alpha, b, b - 2 * side};
    const int32_t highest = fx_max_s32(fx_max_s32(s.a, s.b), s.c);
    const int32_t lowest = fx_min_s32(fx_min_s32(s.a, s.b), s.c);
    if (fx_max_s32(highest, -lowest) <= config->psi_min) {
        return OPEN_SWITCH_NONE;
    }
    return (highest > -lowest) ? OPEN_SWITCH_LOWER : OPEN_SWITCH_UPPER;
}

/* d_x after this sample of a current in the direction of the diode. */
static uint16_t one_sided(uint16_t angle_q16, int32_t through_diode, int32_t i_min, uint32_t step_q16)
{
    return (through_diode < -i_min) ? 0U : larger_angle(angle_q16, step_q16);
}

open_switch_t open_switch_by_currents(const open_switch_config_t *config, open_switch_state_t *state,
                                      const open_switch_in_t *in)
{
    const int32_t i_min = config->i_min;
    if (in->i_squared_q30 == OPEN_SWITCH_NOT_PLAUSIBLE) {
        return OPEN_SWITCH_NONE;
    }
    const abc_q15_t out = in->upper ? (abc_q15_t){-in->i.a, -in->i.b, -in->i.c} : in->i; /* as the diodes conduct */
    const uint32_t step = (in->i_squared_q30 < SIGNIFICANT * i_min * SIGNIFICANT * i_min) ? 0U : in->step_q16;
    uint16_t *const angle = state->one_sided_q16;
    const uint16_t a = one_sided(angle[0], out.a, i_min, step);
    const uint16_t b = one_sided(angle[1], out.b, i_min, step);
    const uint16_t c = one_sided(angle[2], out.c, i_min, step);
    angle[0] = a;
    angle[1] = b;
    angle[2] = c;
    if (a < TURN_Q16 && b < TURN_Q16 && c < TURN_Q16) {
        return OPEN_SWITCH_NONE;
    }
    return in->upper ? OPEN_SWITCH_UPPER : OPEN_SWITCH_LOWER;
}
