/* SPDX-License-Identifier: Apache-2.0 */
#include "control/current_control.h"

#include "fx/circle.h"
#include "fx/q.h"

#define HALF_LSB_Q22 64
#define D_SHARE Q15(0.7) /* what is left to d beside q in any case (CC-11) */

void current_control_reset(current_control_state_t *state)
{
    *state = (current_control_state_t){0};
}

/* f = psi* - (1 - b)(l i*) + (r/sigma) i*; lift is psi* less the magnet's share, from (CC-5). */
static __attribute__((cold)) q15_t weighted(const current_control_config_t *config, int32_t psi, int32_t from,
                                            int32_t i_ref)
{
    const q15_t lift = fx_sat_q15(psi - from);
    const int32_t less = lift - fx_mul_q15(config->setpoint_weight, lift);
    return fx_sat_q15(psi - less + fx_mul_gain_q15(config->drop_gain, (q15_t)i_ref));
}

current_target_t current_control_target(const current_control_config_t *config, dq_t i_ref, const flux_point_t *at_ref)
{
    return (current_target_t){
        .psi = {at_ref->psi_d, at_ref->psi_q},
        .weighted_q30 = {weighted(config, at_ref->psi_d, at_ref->psi_f0, i_ref.d) * 32768,
                         weighted(config, at_ref->psi_q, 0, i_ref.q) * 32768},
    };
}

/* One axis without limits: u = sigma (f - psi) + s + feed-forward (CC-4). Q24 * Q30 = Q22; the difference of two q15
 * numbers fits Q30. */
static int32_t axis(int32_t sigma_q24, int32_t weighted_q30, int32_t psi, int32_t slow_q30)
{
    return fx_mulhi_add(slow_q30 >> 8, sigma_q24, weighted_q30 - psi * 32768);
}

/* s += sigma a_i e: Q15 * Q15 = Q30 with a gain below 1/2. |s| <= 1, so that slow and rotational voltage fit Q30. */
static int32_t integrate(int32_t s_q30, int32_t gain, int32_t error)
{
    return fx_sat_bits(s_q30 + gain * error, 31);
}

/* 1/(v_ratio v_dc), Q25 (CC-15). Q31/Q15 = Q16; of 64 and more, it is 64. */
static int32_t per_v_max(const current_control_config_t *config, int32_t v_dc)
{
    return fx_usat_bits(fx_quotient(config->per_ratio_q31, (uint32_t)v_dc), 22) * 512;
}

/* Into [-most - 1, most]: as a magnitude in ones' complement, which needs one comparison. */
static int32_t within(int32_t x, int32_t most)
{
    return fx_min_s32(x ^ (x >> 31), most) ^ (fx_arch_opaque(x) >> 31);
}

/* What the circle leaves one axis beside the other one's share, and never less than a quarter (CC-11). */
static int32_t room(int32_t other)
{
    const uint16_t *table = fx_circle_table;
    __asm__("" : "+r"(table)); /* else found from the address of another table */
    return table[(other ^ (other >> 31)) >> 7];
}

/* d first while it takes flux away; what it is short of is taken off q (CC-14). While it asks for flux back, q is what
 * may hold that flux, and comes first; d keeps 0.7 of the circle, else the flux would fall on, and i_d grow (CC-11). */
static dq_t cut(dq_t v, int32_t error_d, int32_t omega)
{
    const dq_t most = {fx_sat_q15_word(v.d), fx_sat_q15_word(v.q)};
    if (error_d > 0) {
        return (dq_t){within(most.d, fx_max_s32(room(most.q), D_SHARE)), most.q};
    }
    const int32_t missing = fx_sat_q15_word(v.d - most.d);
    const int32_t sign = omega >> 31; /* the exact negative: nothing missing must take nothing off */
    return (dq_t){most.d, within(v.q + (missing ^ sign) - sign, room(most.d))};
}

/* s += a T_s (u_limited - u): what was cut away, at most four times the circle, is no error to
 * be integrated (CC-10). Q33 * Q13 = Q30. */
static int32_t track(int32_t s_q30, int32_t gain_q33, int32_t missing)
{
    return fx_sat_bits(fx_mac_q31_word(s_q30, gain_q33, fx_sat_q15_word(missing >> 2)), 31);
}

current_control_out_t current_control_step(const current_control_config_t *config, current_control_state_t *state,
                                           const current_control_in_t *in)
{
    const dq_t psi = {in->flux->psi_d, in->flux->psi_q};
    const current_target_t to = *in->target;
    const fx_arch_two_t slow = fx_arch_load_two(&state->s_d_q30);
    const current_control_state_t s = {slow.first, slow.second};
    const int32_t error_d = to.psi.d - psi.d;
    const int32_t omega = fx_arch_opaque(in->omega >> 16);
    const int32_t psi_d = fx_sat_q15_word(psi.d + in->psi_delta);
    /* |s| <= 1 and |w psi| <= 1: at most 2^31 - 1. */
    const dq_t u_q22 = {axis(config->sigma_q24, to.weighted_q30.d, psi.d, s.s_d_q30 - omega * psi.q),
                        axis(config->sigma_q24, to.weighted_q30.q, psi.q, s.s_q_q30 + omega * psi_d)};
    const current_control_state_t next = {integrate(s.s_d_q30, config->integral_gain, error_d),
                                          integrate(s.s_q_q30, config->integral_gain, to.psi.q - psi.q)};
    const dq_t u = {fx_sat_q15_word((u_q22.d + HALF_LSB_Q22) >> 7), fx_sat_q15_word((u_q22.q + HALF_LSB_Q22) >> 7)};

    const int32_t per_q25 = per_v_max(config, in->v_dc);
    const dq_t v = {fx_mulhi(per_q25, u_q22.d), fx_mulhi(per_q25, u_q22.q)}; /* Q25 * Q22 = Q15, below 2^30 */
    const fx_pair_t both = fx_arch_pkhbt(fx_sat_q15_word(v.d), fx_sat_q15_word(v.q));
    if (__builtin_expect((uint32_t)fx_dot2(both, both) < config->clear_q30, 1)) {
        *state = next;
        return (current_control_out_t){.u = u, .v = both, .clear = true};
    }
    const dq_t left = cut(v, error_d, omega);
    const dq_t missing = {left.d - v.d, left.q - v.q};
    const int32_t gain_q33 = fx_mul_q31_word(config->tracking_gain_q34, in->v_dc); /* per unit of v: Q34 * Q15 */
    *state = (current_control_state_t){track(next.s_d_q30, gain_q33, missing.d),
                                       track(next.s_q_q30, gain_q33, missing.q)};
    return (current_control_out_t){
        .u = u,
        .v = fx_arch_pkhbt(left.d, left.q),
        .limited = (uint32_t)(missing.d | missing.q),
    };
}
