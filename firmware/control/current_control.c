/* SPDX-License-Identifier: Apache-2.0 */
#include "control/current_control.h"

#include "fx/div.h"
#include "fx/q.h"
#include "fx/sqrt.h"
#include "fx/vec.h"

/* The d axis comes first, but never takes all: with no room at all the q axis could not shed the flux that
 * binds the d axis, and both would stay where they are. 31/32 leave it a quarter of the circle (CC-11). */
#define D_RESERVE_SHIFT 5
#define LONGEST 45874 /* 1.4 pu: its half, squared twice, keeps a length below 1 */

typedef struct {
    int32_t error; /* psi* - psi, Q15 */
    int32_t u;     /* before the limiter, Q15 */
} axis_t;

void current_control_reset(current_control_state_t *state)
{
    *state = (current_control_state_t){0};
}

/* f = psi* - (1 - b)(l i*) + (r/sigma) i*; lift is psi* less the magnet's share, from (CC-5). */
static q15_t weighted(const current_control_config_t *config, int32_t psi, int32_t from, int32_t i_ref)
{
    const q15_t lift = fx_sat_q15(psi - from);
    const int32_t less = lift - fx_mul_q15(config->setpoint_weight, lift);
    return fx_sat_q15(psi - less + fx_mul_gain_q15(config->drop_gain, (q15_t)i_ref));
}

current_target_t current_control_target(const current_control_config_t *config, dq_t i_ref, const flux_point_t *at_ref)
{
    return (current_target_t){
        .psi = {at_ref->psi_d, at_ref->psi_q},
        .weighted = {weighted(config, at_ref->psi_d, at_ref->psi_f0, i_ref.d),
                     weighted(config, at_ref->psi_q, 0, i_ref.q)},
    };
}

/* One axis without limits: u = sigma (f - psi) + s + feed-forward (CC-4). Q16 * Q31 = Q15. */
static axis_t axis(q16_t sigma, int32_t target, int32_t weighted_target, int32_t psi, q31_t s, int32_t forward_q30)
{
    const int32_t slow = fx_add_q31(fx_add_q31(s >> 1, forward_q30), 0x4000) >> 15;
    return (axis_t){
        .error = fx_sat_q15_word(target - psi),
        .u = fx_mulhi_add(slow, sigma, fx_sat_q15_word(weighted_target - psi) * 65536),
    };
}

/* s += sigma a_i e + a T_s (u_limited - u): what the circle cut away is no error to be integrated (CC-10).
 * Two products of Q15 * Q15 = Q30, both gains below 1/2, counted twice for Q31. */
static q31_t integrate(const current_control_config_t *config, const axis_t *a, q31_t s, int32_t limited_u)
{
    const int32_t cut = fx_sat_q15_word(limited_u - a->u);
    return fx_add2_q31(s, config->integral_gain * a->error + config->tracking_gain * cut);
}

/* The whole vector shortened, its direction kept up to 1.4 pu per axis: so long, half of it still has a length
 * below 1. */
static dq_t shortened(axis_t d, axis_t q, int32_t v_max)
{
    const int32_t u_d = fx_clamp_q31(d.u, -LONGEST, LONGEST);
    const int32_t u_q = fx_clamp_q31(q.u, -LONGEST, LONGEST);
    const int32_t half = fx_magnitude((q15_t)(u_d / 2), (q15_t)(u_q / 2));
    const int32_t share = fx_div_s32(v_max * 16384, half); /* Q15 * Q14 / Q15 of half = Q15, <= 1 */
    return (dq_t){(u_d * share + 0x4000) >> 15, (u_q * share + 0x4000) >> 15};
}

/* Inside the circle as wanted. Beyond it the d axis comes first while it takes flux away (CC-11). While it asks for
 * flux back, the q axis may be what holds that flux: a cut that served d first would leave both where they are, at
 * any torque. */
static __attribute__((noinline)) dq_t limit(axis_t d, axis_t q, int32_t v_max)
{
    const bool more_flux = d.error > 0;
    const int32_t d_max = more_flux ? v_max : v_max - (v_max >> D_RESERVE_SHIFT);
    const int32_t u_d = fx_clamp_q31(d.u, -d_max, d_max);
    int32_t u_q = fx_clamp_q31(q.u, -v_max, v_max);
    const int32_t room = v_max * v_max - u_d * u_d; /* Q30 */
    if (u_d == d.u && u_q * u_q <= room && u_q == q.u) {
        return (dq_t){u_d, u_q};
    }
    if (more_flux) {
        return shortened(d, q, v_max);
    }
    if (u_q * u_q > room) {
        const int32_t q_max = fx_sqrt_q30((uint32_t)room);
        u_q = fx_clamp_q31(u_q, -q_max, q_max);
    }
    return (dq_t){u_d, u_q};
}

/* Nothing for the limiter to do: |u_d| <= d_max and |u| <= v_max, which is below 1: saturated squares tell as much. */
static bool inside(int32_t u_d, int32_t u_q, int32_t v_max)
{
    const int32_t d_max = v_max - (v_max >> D_RESERVE_SHIFT);
    const int32_t d = fx_sat_q15_word(u_d);
    const int32_t q = fx_sat_q15_word(u_q);
    return (uint32_t)(d * d) + (uint32_t)(q * q) <= (uint32_t)(v_max * v_max) &&
           (uint32_t)(u_d + d_max) <= 2U * (uint32_t)d_max;
}

dq_t current_control_step(const current_control_config_t *config, current_control_state_t *state,
                          const current_control_in_t *in)
{
    const flux_point_t *flux = in->flux;
    const current_target_t *to = in->target;
    const q16_t sigma = config->sigma_gain;
    const int32_t psi_d = fx_sat_q15_word(flux->psi_d + in->psi_delta);
    const axis_t d = axis(sigma, to->psi.d, to->weighted.d, flux->psi_d, state->s_d, -(in->omega * flux->psi_q));
    const axis_t q = axis(sigma, to->psi.q, to->weighted.q, flux->psi_q, state->s_q, in->omega * psi_d);

    /* A dc voltage below zero is an offset of its sensor: nothing is left to apply. */
    const int32_t v_max = fx_max_s32((config->v_ratio * in->v_dc + 0x4000) >> 15, 0);
    dq_t u = {d.u, q.u};
    if (!inside(d.u, q.u, v_max)) {
        u = limit(d, q, v_max);
    }
    state->limited = u.d != d.u || u.q != q.u;
    state->s_d = integrate(config, &d, state->s_d, u.d);
    state->s_q = integrate(config, &q, state->s_q, u.q);
    return u;
}
