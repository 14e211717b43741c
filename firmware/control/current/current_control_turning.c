/* SPDX-License-Identifier: Apache-2.0 */
#include "control/current/current_control_turning.h"

#include "control/current/current_control_circle.h"
#include "fx/trig.h"

#define HALF_LSB_Q22 64

/* (cos, sin) of an angle, and products with it. */
typedef struct {
    int32_t cos, sin;
} turn_t;

/* Formats that only this law uses. */
typedef struct {
    int32_t d, q;
} dq_q25_t;

typedef struct {
    int32_t d, q;
} dq_q29_t;

void turning_control_reset(turning_control_state_t *state)
{
    *state = (turning_control_state_t){0};
}

static turn_t turn_of(uint32_t angle)
{
    const fx_sincos_t x = fx_sincos((uint16_t)(angle >> 16));
    return (turn_t){x.cos, x.sin};
}

/* x e^(-j angle); half of it, because the product of a Q31 and a Q15 number is Q30. */
static dq_q29_t half_turned_back(int32_t d, int32_t q, turn_t at)
{
    return (dq_q29_t){fx_mul_q31_word(d, at.cos) + fx_mul_q31_word(q, at.sin),
                      fx_mul_q31_word(q, at.cos) - fx_mul_q31_word(d, at.sin)};
}

/* One axis of r' = r + alpha (psi* - r). Q31 * Q30 = Q29. */
static int32_t approach(const turning_control_config_t *config, int32_t r_q30, int32_t psi)
{
    return r_q30 + 2 * fx_mulhi(config->approach, psi * 32768 - r_q30);
}

/* (e^(j theta/2) r' - e^(-j theta/2) r)/T_s = (cos(theta/2) (r' - r) + j sin(theta/2) (r' + r))/T_s (CC-17). In Q29 sum
 * and difference fit; Q29 * Q15 = Q28, below 3; Q28 * Q29 = Q25. */
static dq_q25_t voltage_of_model(const turning_control_config_t *config, dq_q30_t from, dq_q30_t to, turn_t half)
{
    const dq_q29_t a = {from.d >> 1, from.q >> 1};
    const dq_q29_t b = {to.d >> 1, to.q >> 1};
    const int32_t d = fx_mul_q31_word(b.d - a.d, half.cos) - fx_mul_q31_word(b.q + a.q, half.sin);
    const int32_t q = fx_mul_q31_word(b.q - a.q, half.cos) + fx_mul_q31_word(b.d + a.d, half.sin);
    return (dq_q25_t){fx_mulhi(config->per_period_q29, d), fx_mulhi(config->per_period_q29, q)};
}

/* j w' x = j 2 sin(theta/2) x/T_s of one axis: Q30 * Q15 = Q29, * Q29 = Q26, which is half in Q25. */
static int32_t rotational_voltage(const turning_control_config_t *config, int32_t x_q30, turn_t half)
{
    return fx_mulhi(config->per_period_q29, fx_mul_q31_word(x_q30, half.sin));
}

/* Q25 * Q35 = Q28. */
static int32_t integrate(int32_t s_q30, int32_t gain_q35, int32_t x_q25)
{
    return fx_sat_bits(s_q30 + 4 * fx_mulhi(gain_q35, x_q25), 31);
}

/* r' of one axis plus the flux that the cut voltage will not make, Q26. */
static int32_t reachable(int32_t r_q30, int32_t cut_q26)
{
    return fx_sat_bits((r_q30 >> 4) + cut_q26, 27) * 16;
}

/* The cut of the voltage, limited to four times the circle, as the flux of one period: (CC-20). Q31 * Q15 = Q30,
 * times Q13 = Q27. */
static void follow_limit(const turning_control_config_t *config, turning_control_state_t *state, dq_q15_t change,
                         int32_t v_dc, turn_t half)
{
    const int32_t flux_q30 = fx_mul_q31_word(config->voltage_to_flux, v_dc);
    const dq_q29_t cut_q26 = half_turned_back(fx_mul_q31_word(flux_q30, fx_sat_q15_word(change.d >> 2)),
                                              fx_mul_q31_word(flux_q30, fx_sat_q15_word(change.q >> 2)), half);
    state->next = (dq_q30_t){reachable(state->next.d, cut_q26.d), reachable(state->next.q, cut_q26.q)};
}

static void begin(turning_control_state_t *state, dq_q15_t psi)
{
    state->now = state->next = (dq_q30_t){psi.d * 32768, psi.q * 32768};
    state->begun = true;
}

/* Voltage before the limit, Q22; the model goes on by a period (CC-16) ... (CC-19). */
static dq_q22_t wanted_voltage(const turning_control_config_t *config, turning_control_state_t *state,
                               const turning_control_in_t *in, dq_q15_t psi, turn_t half)
{
    const dq_q30_t e = {state->now.d - psi.d * 32768, state->now.q - psi.q * 32768};
    const dq_q29_t back = half_turned_back(e.d, e.q, turn_of(in->angle_to_act));
    /* Q31 * Q29 = Q28. */
    const dq_q25_t fed_back = {fx_mulhi(config->feedback, back.d) >> 3, fx_mulhi(config->feedback, back.q) >> 3};
    const dq_q30_t to = {approach(config, state->next.d, in->control.target->psi.d),
                         approach(config, state->next.q, in->control.target->psi.q)};
    const dq_q25_t model = voltage_of_model(config, state->next, to, half);
    const int32_t magnet = rotational_voltage(config, in->control.psi_delta * 32768, half);
    const dq_q25_t drop = {fx_mulhi(config->r, in->i.d * 65536) >> 5, fx_mulhi(config->r, in->i.q * 65536) >> 5};
    const dq_q25_t u = {model.d + fed_back.d + (state->s.d >> 5) + drop.d,
                        model.q + fed_back.q + (state->s.q >> 5) + drop.q + magnet};
    state->s.d = integrate(state->s.d, config->integral_q35, fed_back.d - rotational_voltage(config, e.q, half));
    state->s.q = integrate(state->s.q, config->integral_q35, fed_back.q + rotational_voltage(config, e.d, half));
    state->now = state->next;
    state->next = to;
    return (dq_q22_t){fx_shr_round(u.d, 3), fx_shr_round(u.q, 3)};
}

current_control_out_t turning_control_step(const turning_control_config_t *config,
                                           const current_control_config_t *limits, turning_control_state_t *state,
                                           const turning_control_in_t *in)
{
    const dq_q15_t psi = {in->control.flux->psi_d, in->control.flux->psi_q};
    if (!state->begun) {
        begin(state, psi);
    }
    const turn_t half = turn_of((uint32_t)(in->angle_step >> 1));
    const dq_q22_t u_q22 = wanted_voltage(config, state, in, psi, half);
    const dq_q15_t u = {fx_sat_q15_word((u_q22.d + HALF_LSB_Q22) >> 7), fx_sat_q15_word((u_q22.q + HALF_LSB_Q22) >> 7)};
    const int32_t per_v_max_q25 = reciprocal_v_max(limits->per_ratio_q31, in->control.v_dc);
    const dq_q15_t v = {fx_mulhi(per_v_max_q25, u_q22.d), fx_mulhi(per_v_max_q25, u_q22.q)};
    const fx_pair_t pair = fx_pair(fx_sat_q15_word(v.d), fx_sat_q15_word(v.q));
    if ((uint32_t)fx_dot2(pair, pair) < limits->clear_q30) {
        return (current_control_out_t){.u = u, .v = pair, .clear = true};
    }
    const dq_q15_t limited = limit_to_circle(v, in->control.target->psi.d - psi.d, in->control.omega >> 16);
    const dq_q15_t change = {limited.d - v.d, limited.q - v.q};
    follow_limit(config, state, change, in->control.v_dc, half);
    return (current_control_out_t){
        .u = u,
        .v = fx_pair(limited.d, limited.q),
        .limited = (uint32_t)(change.d | change.q),
    };
}
