/* SPDX-License-Identifier: Apache-2.0 */
/* Current sensors whose common gain jumps: safety/gain_jump. */
#include "proof.h"

#include "fx/format.c"
#include "safety/gain_jump.c"

enum { Q15_X16 = 16 * (INT16_MAX + 1) };

/* All that the properties need of the motor data. */
static torque_monitor_config_t any_config(void)
{
    torque_monitor_config_t c;
    ASSUME(c.v_0 > 0 && c.v_noise >= 0 && c.lag_noise >= 0 && c.i_0 > 0);
    return c;
}

/* The current's magnitude is positive; a reference of -1 in both axes is longer than every current. */
static gain_jump_in_t any_input(void)
{
    gain_jump_in_t in;
    ASSUME(in.current >= 0);
    ASSUME((in.i_ref & 0xFFFFU) != 0x8000U && in.i_ref >> 16 != 0x8000U);
    return in;
}

/* Up to the 40th step a mean times 16, then less than one residual more in each step. With no step what the last
 * decision has left. */
static bool is_bounded(int32_t change_x16, uint8_t steps)
{
    const uint8_t last = (steps == 0U) ? (uint8_t)DECIDED : steps;
    const int32_t max = Q15_X16 + ((last >= (uint8_t)COUNTED) ? (last - COUNTED + 1) * (INT16_MAX + 1) : 0);
    return WITHIN(change_x16, -max, max);
}

static bool is_possible(const gain_jump_state_t *state)
{
    return state->steps < (uint8_t)DECIDED && is_bounded(state->change_x16.d, state->steps) &&
           is_bounded(state->change_x16.q, state->steps) && state->i_ref.d != INT16_MIN && state->i_ref.q != INT16_MIN;
}

static gain_jump_state_t any_state(void)
{
    gain_jump_state_t state;
    ASSUME(is_possible(&state));
    return state;
}

void proof_gain_jump_state_stays_possible(void)
{
    const torque_monitor_config_t c = any_config();
    const gain_jump_in_t in = any_input();
    gain_jump_state_t state = any_state();
    (void)gain_jump_step(&c, &state, &in);
    PROVE(is_possible(&state));
}

void proof_gain_jump_is_decided_in_the_23rd_step(void)
{
    const torque_monitor_config_t c = any_config();
    const gain_jump_in_t in = any_input();
    gain_jump_state_t state = any_state();
    const uint8_t before = state.steps;
    const bool decided = gain_jump_step(&c, &state, &in);
    PROVE(!decided || before == 33 + 22);
    PROVE(state.steps == 0U || state.steps == 1U || state.steps == before || state.steps == before + 1U);
}

void proof_only_a_candidate_is_decided(void)
{
    const torque_monitor_config_t c = any_config();
    const gain_jump_in_t in = any_input();
    gain_jump_state_t state = any_state();
    const uint8_t before = state.steps;
    (void)gain_jump_step(&c, &state, &in);
    PROVE(!(before <= 33U && state.steps > 33U) || (before == 33U && in.current > 4 * c.i_0));
}

void proof_gain_jump_means_lie_between(void)
{
    const gain_jump_in_t in = any_input();
    gain_jump_state_t state = any_state();
    ASSUME(state.steps <= 33U);
    const gain_jump_state_t before = state;
    follow(&state, &in);
    const int32_t low = fx_min_s32(before.change_x16.d, 16 * in.residual.d);
    const int32_t high = fx_max_s32(before.change_x16.d, 16 * in.residual.d);
    PROVE(WITHIN(state.change_x16.d, low, high));
    PROVE(WITHIN(state.omega, fx_min_s32(before.omega, in.omega), fx_max_s32(before.omega, in.omega)));
}

/* What the inverter may change is no jump: 12 |u| <= v_0 + v_noise, for which 0.7 of it in each axis is enough. */
void proof_an_error_of_the_inverter_is_no_gain_jump(void)
{
    const torque_monitor_config_t c = any_config();
    const gain_jump_state_t state = any_state();
    dq_q15_t quarter;
    ASSUME(WITHIN(quarter.d, -(1 << 14), 1 << 14) && WITHIN(quarter.q, -(1 << 14), 1 << 14));
    const int32_t d = state.change_x16.d >> 4, q = state.change_x16.q >> 4, v = c.v_0 + c.v_noise;
    ASSUME(IS_Q15(d) && IS_Q15(q) && IS_Q15(v));
    ASSUME(12 * fx_max_s32(fx_abs_q31(d), fx_abs_q31(q)) <= (v * 45) >> 6);
    PROVE(!gain_jump_is_found(&c, &state, quarter));
}

/* Across the voltage of the current it is no jump either: |u x D| >= |u.D|/2. Both products are rounded to 4 LSB, of
 * which the difference of these shares is more from 9 LSB of D/4 on. */
void proof_a_voltage_across_is_no_gain_jump(void)
{
    const torque_monitor_config_t c = any_config();
    const gain_jump_state_t state = any_state();
    dq_q15_t quarter;
    ASSUME(WITHIN(fx_abs_q31(quarter.d), 9, 1 << 14) && quarter.q == 0);
    const int32_t d = state.change_x16.d >> 4, q = state.change_x16.q >> 4;
    ASSUME(IS_Q15(d) && IS_Q15(q) && 2 * fx_abs_q31(q) >= fx_abs_q31(d));
    PROVE(!gain_jump_is_found(&c, &state, quarter));
}
