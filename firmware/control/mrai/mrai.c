/* SPDX-License-Identifier: Apache-2.0 */
#include "control/mrai/mrai.h"

#include "fx/codegen.h"
#include "fx/q.h"

/* Limit of the observer error: 4 pu. With slow poles e = T_s w dpsi/(2 s2) is large: 1.5 pu at full speed for a magnet
 * that is 15 % weak (hsm1). A tighter limit would falsify the adaptation. */
#define ERROR_BITS 30
/* |s2 e| < 1/16 in the laws: it fits Q35, in which small steps of the adaptation are not rounded away. */
#define INNOVATION_BITS 24
#define INNOVATION_SCALE 256

/* Weight of the d equation (MR-7). */
#define WEIGHT_D 2

typedef struct {
    int32_t d, q;
} dq_q35_t;

static bool are_limits_valid(q31_t lo, q31_t hi)
{
    return lo < hi && lo >= Q31(-0.5) && hi <= Q31(0.5);
}

FX_COLD motor_check_t mrai_check(const mrai_config_t *c)
{
    if (c->r0 <= 0 || c->pole_gain <= 0 || c->period <= 0 || c->period > Q31(0.78) || c->flux_gain < 0 ||
        c->resistance_gain < 0 || c->flux_proportional_q24 < 0 || c->resistance_proportional_q24 < 0) {
        return MOTOR_CHECK_MRAI_GAINS;
    }
    if (!are_limits_valid(c->psi_delta_min, c->psi_delta_max) || !are_limits_valid(c->r_delta_min, c->r_delta_max)) {
        return MOTOR_CHECK_MRAI_LIMITS;
    }
    if (c->omega_min <= 0 || c->psi_drift_full <= 0 || c->r_drift_full <= 0) {
        return MOTOR_CHECK_MRAI_GATES;
    }
    return MOTOR_CHECK_OK;
}

/* Q27 to Q35, limited. */
static int32_t innovation(int32_t s2e_q27)
{
    return fx_sat_bits(s2e_q27, INNOVATION_BITS) * INNOVATION_SCALE;
}

/* One law: I -= step, clamped (MR-9, MR-10). */
static q31_t adapt(q31_t integral, q31_t step, q31_t min, q31_t max)
{
    const q31_t moved = fx_sub_q31(integral, step);
    return fx_clamp_q31(moved, min, max);
}

/* The parameter used in this step: integral part plus proportional part. Q31 * Q24 = Q23; limited to 1/2 pu, so that
 * the sum with the limited integral part cannot overflow. */
static q31_t with_proportional_part(q31_t integral, q31_t step, int32_t proportional_q24)
{
    return integral - fx_sat_bits(fx_mulhi(step, proportional_q24), 23) * 256;
}

/* (8) normalised: dpsi -= 2 k_psi s2 e_q/w. Q28 * Q35 = Q31. */
static q31_t adapt_flux(const mrai_config_t *config, int32_t step_q28, mrai_state_t *state, int32_t innovation_q)
{
    const q31_t step = fx_mulhi(step_q28, innovation_q);
    const q31_t moved = adapt(state->psi_delta, step, config->psi_delta_min, config->psi_delta_max);
    state->psi_delta = moved;
    return with_proportional_part(moved, step, config->flux_proportional_q24);
}

/* (7) normalised: dR -= k s2 (2 i_d e_d + i_q e_q), i weighted, Q28. Q35 * Q28 = Q31, at most 1/8; * Q26 = Q25,
 * saturated. */
static q31_t adapt_resistance(const mrai_config_t *config, int32_t step_q26, mrai_state_t *state, dq_q28_t i,
                              dq_q35_t innovation)
{
    const int32_t power_q31 = fx_mulhi_add(fx_mulhi(innovation.d, i.d), innovation.q, i.q);
    const q31_t step = fx_sat_bits(fx_mulhi(step_q26, power_q31), 26) * 64;
    const q31_t moved = adapt(state->r_delta, step, config->r_delta_min, config->r_delta_max);
    state->r_delta = moved;
    return with_proportional_part(moved, step, config->resistance_proportional_q24);
}

/* Current with the weight of each equation. */
static dq_q28_t weighted(const dq_q15_t *i)
{
    return (dq_q28_t){i->d * (8192 * WEIGHT_D), i->q * 8192};
}

/* One of the two terms of the trapezoidal mean of rotational and resistive voltage, as flux: T_s/2 (R^ i_d - w psi_q)
 * and T_s/2 (R^ i_q + w (psi_d + dpsi)) at one end of the period, weighted (MR-6). Q30 * Q28 = Q26, which is half in
 * Q27. */
static dq_q27_t half_voltage(const mrai_config_t *config, const operating_point_t *in, dq_q28_t i, q31_t psi_used,
                             q31_t r_used, dq_q15_t *psi)
{
    const int32_t drop_q30 = fx_mulhi(fx_add_q31(config->r0, r_used), config->period);
    const dq_q27_t drop = {fx_mulhi(drop_q30, i.d), fx_mulhi(drop_q30, i.q)};
    const int32_t rotation_q30 = fx_mulhi(in->omega, config->period);
    *psi = (dq_q15_t){in->flux.psi_d, in->flux.psi_q};
    const int32_t psi_d_q28 = psi->d * 8192 + (psi_used >> 3);
    return (dq_q27_t){fx_mulhi_sub(drop.d, rotation_q30, psi->q * (8192 * WEIGHT_D)),
                      fx_mulhi_add(drop.q, rotation_q30, psi_d_q28)};
}

/* The terms of the next error that this sample, the first of its period, already determines. */
static void begin_period(const mrai_schedule_t *schedule, mrai_state_t *state, const dq_q15_t *u, dq_q15_t psi,
                         dq_q27_t e, dq_q27_t half)
{
    state->e_d_q27 = e.d;
    state->e_q_q27 = e.q;
    const int32_t predicted_d = fx_mulhi_add(e.d - psi.d * (4096 * WEIGHT_D) + half.d, schedule->minus_voltage_d_q28,
                                             u->d * 65536);
    const int32_t predicted_q = fx_mulhi_add(e.q - psi.q * 4096 + half.q, schedule->minus_voltage_q28, u->q * 65536);
    state->predicted_d_q27 = predicted_d;
    state->predicted_q_q27 = predicted_q;
}

/* The voltage equation over the period that ends with this sample, in flux (MR-6); trapezoidal means make it exact in
 * steady state. In Q27 the d axis is the larger one: 4 + 2 (1 + 1 + 0.8) + 2 + 2 (1 + 1) < 16. */
void mrai_step(const mrai_config_t *config, const mrai_schedule_t *schedule, mrai_state_t *state,
               const operating_point_t *in)
{
    /* (MR-7): 4 s2 in Q30, which is s2 in Q32, below 1/4. */
    const int32_t s2_q32 = fx_mul_q31_word(config->pole_gain, in->flux.g);
    const dq_q27_t s2e = {fx_mulhi(s2_q32, state->e_d_q27), fx_mulhi(s2_q32, state->e_q_q27)};
    const int32_t innovation_q = innovation(s2e.q);
    const q31_t psi_used = adapt_flux(config, schedule->flux_step_q28, state, innovation_q);
    const dq_q35_t innovations = {innovation(s2e.d), innovation_q};
    const dq_q28_t i = weighted(&in->i);
    const q31_t r_used = adapt_resistance(config, schedule->resistance_step_q26, state, i, innovations);
    dq_q15_t psi;
    const dq_q27_t half = half_voltage(config, in, i, psi_used, r_used, &psi);
    const dq_q27_t e = {state->predicted_d_q27 - s2e.d + s2e.q, state->predicted_q_q27 - s2e.d - s2e.q};
    const dq_q27_t now = {fx_sat_bits(e.d + psi.d * (4096 * WEIGHT_D) + half.d, ERROR_BITS),
                          fx_sat_bits(e.q + psi.q * 4096 + half.q, ERROR_BITS)};
    begin_period(schedule, state, &in->u, psi, now, half);
}

/* Without an error before it the step changes no parameter: its innovations are zero. */
FX_COLD void mrai_start_before_step(mrai_state_t *state)
{
    state->e_d_q27 = 0;
    state->e_q_q27 = 0;
}

/* The step has left in e the flux that the terms of the next error begin with. */
FX_COLD void mrai_start_after_step(mrai_state_t *state)
{
    state->predicted_d_q27 -= state->e_d_q27;
    state->predicted_q_q27 -= state->e_q_q27;
    state->e_d_q27 = 0;
    state->e_q_q27 = 0;
}
