/* SPDX-License-Identifier: Apache-2.0 */
#include "control/current/current_control_turning.h"

#include "fx/codegen.h"
#include "fx/trig.h"

#define Q29_PER_Q15 16384

void turning_control_reset(turning_control_state_t *state, const flux_point_t *flux)
{
    const dq_q29_t psi = {flux->psi_d * Q29_PER_Q15, flux->psi_q * Q29_PER_Q15};
    *state = (turning_control_state_t){.now = psi, .next = psi};
}

/* e^(j angle) end - e^(-j angle) begin, the flux that takes the machine from begin to end (CC-17). It has half the
 * scale of the arguments, because the product of a Q29 and a Q15 number is Q28. */
static FX_NOT_INLINED void across(const dq_q29_t *end, const dq_q29_t *begin, uint32_t angle, dq_q28_t *flux)
{
    const fx_pair_t at = fx_unit_vector(angle);
    const int32_t cos = (int32_t)at;
    const int32_t sin = (int32_t)at >> 16;
    flux->d = fx_mul_q31_word(end->d - begin->d, cos) - fx_mul_q31_word(end->q + begin->q, sin);
    flux->q = fx_mul_q31_word(end->q - begin->q, cos) + fx_mul_q31_word(end->d + begin->d, sin);
}

/* One axis of r' = r + alpha (psi* - r). */
static int32_t approach(const turning_control_config_t *config, int32_t r_q29, int32_t psi_ref)
{
    return fx_mulhi_add(r_q29, config->approach_q32, psi_ref * Q29_PER_Q15 - r_q29);
}

/* One axis: the voltage, Q30, limited to V_b (CC-18); the integral part (CC-19). Q29 * Q28 = Q25, below 64. */
static FX_NOT_INLINED int32_t voltage(const turning_control_config_t *config, int32_t *s_q28, int32_t flux,
                                      int32_t back, int32_t rotational, int32_t i)
{
    const int32_t fed_back = fx_mulhi(config->feedback_q32, back);
    const int32_t wanted = flux + fed_back + *s_q28 + fx_mulhi(config->drop_q29, i * 65536);
    *s_q28 = fx_sat_bits(fx_mulhi_add(*s_q28, config->integral_q32, fed_back + rotational), 30);
    return fx_sat_bits(fx_mulhi(config->per_period_q29, wanted), 26) * 32;
}

/* One axis: the model's flux plus the flux of u_limited - u, which the limit removes. Q30/16/2 = Q25. */
static int32_t reachable(int32_t r_q29, int32_t cut_q25)
{
    return fx_sat_bits((r_q29 >> 4) + cut_q25, 26) * 16;
}

current_control_out_t turning_control_step(const turning_control_config_t *config,
                                           const current_control_config_t *limits, turning_control_state_t *state,
                                           const turning_control_in_t *in)
{
    const current_control_in_t *control = &in->control;
    const uint32_t half = (uint32_t)(in->angle_step >> 1);
    const int32_t psi_d_error = in->psi_d_error * Q29_PER_Q15;
    const dq_q29_t none = {0, 0};
    const dq_q29_t e = {state->now.d - control->flux->psi_d * Q29_PER_Q15,
                        state->now.q - control->flux->psi_q * Q29_PER_Q15};
    const dq_q29_t begin = state->next;
    const dq_q29_t end = {approach(config, begin.d, control->target->psi.d),
                          approach(config, begin.q, control->target->psi.q)};
    state->now = begin;
    dq_q28_t model, back, rotational;
    across(&(dq_q29_t){end.d + psi_d_error, end.q}, &(dq_q29_t){begin.d + psi_d_error, begin.q}, half, &model);
    across(&e, &none, 0U - 3U * half, &back);
    across(&e, &e, half, &rotational);
    const dq_q30_t u = {voltage(config, &state->s.d, model.d, back.d, rotational.d, in->i.d),
                        voltage(config, &state->s.q, model.q, back.q, rotational.q, in->i.q)};
    /* With gains of 0, the usual law's voltage is its integrator. To this the anti-windup adds what the limit cuts: as
     * the flux of a period, and a sixteenth of it (CC-20). */
    current_control_state_t integrator = {u.d, u.q};
    const current_control_out_t out = current_control_step(limits, &integrator, control);
    across(&(dq_q29_t){integrator.s_d_q30 - u.d, integrator.s_q_q30 - u.q}, &none, 0U - half, &back);
    state->next = (dq_q29_t){reachable(end.d, back.d), reachable(end.q, back.q)};
    return out;
}
