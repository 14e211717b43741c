/* SPDX-License-Identifier: Apache-2.0 */
#include "control/current/current_control.h"

#include "fx/circle.h"
#include "fx/codegen.h"
#include "fx/div.h"
#include "fx/q.h"

#define HALF_LSB_Q22 64
#define V_D_MIN Q15(0.7) /* share of the circle that the d axis may always use (CC-11) */

void current_control_reset(current_control_state_t *state)
{
    *state = (current_control_state_t){0};
}

/* f = psi* - (1 - b)(l i*) + (r/sigma) i*, where l i* is psi* minus the magnet's flux (CC-5). */
static FX_COLD int32_t weighted_reference(const current_control_config_t *config, int32_t psi, int32_t psi_magnet,
                                          int32_t i_ref)
{
    const int32_t l_i = fx_sat_q15_word(psi - psi_magnet);
    const int32_t reduction = l_i - fx_mul_q15(config->setpoint_weight, l_i);
    const int32_t drop = fx_mul_gain_q15_word(config->drop_gain, i_ref);
    return fx_sat_q15_word(psi - reduction + drop);
}

current_target_t current_control_target(const current_control_config_t *config, dq_q15_t i_ref,
                                        const flux_point_t *at_ref)
{
    return (current_target_t){
        .psi = {at_ref->psi_d, at_ref->psi_q},
        .weighted = {weighted_reference(config, at_ref->psi_d, at_ref->psi_f0, i_ref.d) * 32768,
                     weighted_reference(config, at_ref->psi_q, 0, i_ref.q) * 32768},
    };
}

/* One axis before the limit: u = sigma (f - psi) + s + feed-forward (CC-4), the last two summed in s_and_ff. Q24 * Q30
 * = Q22; the difference of two q15 numbers fits Q30. */
static int32_t unlimited_voltage(int32_t sigma_q24, int32_t weighted_q30, int32_t psi, int32_t s_and_ff_q30)
{
    return fx_mulhi_add(s_and_ff_q30 >> 8, sigma_q24, weighted_q30 - psi * 32768);
}

/* s += sigma a_i e: Q15 * Q15 = Q30 with a gain below 1/2. |s| <= 1, so that the sum of s and the rotational voltage
 * fits Q30. */
static int32_t integrate(int32_t s_q30, int32_t gain, int32_t error)
{
    return fx_sat_bits(s_q30 + gain * error, 31);
}

/* 1/(v_ratio v_dc), Q25 (CC-15), at most 64. Q31/Q15 = Q16. */
static int32_t reciprocal_v_max(const current_control_config_t *config, int32_t v_dc)
{
    return fx_usat_bits(fx_quotient(config->per_ratio_q31, (uint32_t)v_dc), 22) * 512;
}

/* Clamps to [-limit - 1, limit]. The magnitude is the ones' complement, so that one comparison is enough. */
static int32_t clamp_symmetric(int32_t x, int32_t limit)
{
    return fx_min_s32(x ^ (x >> 31), limit) ^ (x >> 31);
}

/* Largest voltage of one axis inside the unit circle, given the other axis' voltage; at least a quarter (CC-11). */
static int32_t remaining_voltage(int32_t other)
{
    return fx_circle_table[(other ^ (other >> 31)) >> 7];
}

/* While the d flux is to fall, the d axis has priority, and its excess is subtracted from q (CC-14). While the d flux
 * is to rise, the q axis has priority, because the q flux may be what limits the d axis; d keeps 0.7 of the circle, or
 * else the d flux would fall further and i_d would grow (CC-11). */
static dq_q15_t limit_to_circle(dq_q15_t v, int32_t error_d, int32_t omega)
{
    const dq_q15_t clipped = {fx_sat_q15_word(v.d), fx_sat_q15_word(v.q)};
    if (error_d > 0) {
        return (dq_q15_t){clamp_symmetric(clipped.d, fx_max_s32(remaining_voltage(clipped.q), V_D_MIN)), clipped.q};
    }
    const int32_t excess = fx_sat_q15_word(v.d - clipped.d);
    const int32_t sign = omega >> 31; /* 0 or -1: with two's complement an excess of 0 changes nothing */
    const int32_t reduced_q = v.q + (excess ^ sign) - sign;
    return (dq_q15_t){clipped.d, clamp_symmetric(reduced_q, remaining_voltage(clipped.d))};
}

/* s += a T_s (u_limited - u), the difference limited to four times the circle (CC-10). Q33 * Q13 = Q30. */
static int32_t anti_windup(int32_t s_q30, int32_t gain_q33, int32_t change)
{
    return fx_sat_bits(fx_mac_q31_word(s_q30, gain_q33, fx_sat_q15_word(change >> 2)), 31);
}

current_control_out_t current_control_step(const current_control_config_t *config, current_control_state_t *state,
                                           const current_control_in_t *in)
{
    const dq_q15_t psi = {in->flux->psi_d, in->flux->psi_q};
    const current_target_t to = *in->target;
    const fx_two_words_t integrators = FX_LOAD_TWO(state, s_d_q30, s_q_q30);
    const current_control_state_t s = {integrators.first, integrators.second};
    const int32_t error_d = to.psi.d - psi.d;
    const int32_t omega = fx_in_register(in->omega >> 16);
    const int32_t psi_d = fx_sat_q15_word(psi.d + in->psi_d_error);
    /* |s| <= 1 and |w psi| <= 1: at most 2^31 - 1. */
    const dq_q22_t u_q22 = {unlimited_voltage(config->sigma_q24, to.weighted.d, psi.d, s.s_d_q30 - omega * psi.q),
                            unlimited_voltage(config->sigma_q24, to.weighted.q, psi.q, s.s_q_q30 + omega * psi_d)};
    const current_control_state_t next = {integrate(s.s_d_q30, config->integral_gain, error_d),
                                          integrate(s.s_q_q30, config->integral_gain, to.psi.q - psi.q)};
    const dq_q15_t u = {fx_sat_q15_word((u_q22.d + HALF_LSB_Q22) >> 7), fx_sat_q15_word((u_q22.q + HALF_LSB_Q22) >> 7)};

    const int32_t per_v_max_q25 = reciprocal_v_max(config, in->v_dc);
    /* Q25 * Q22 = Q15, below 2^30. */
    const dq_q15_t v = {fx_mulhi(per_v_max_q25, u_q22.d), fx_mulhi(per_v_max_q25, u_q22.q)};
    const fx_pair_t v_pair = fx_pair(fx_sat_q15_word(v.d), fx_sat_q15_word(v.q));
    if (FX_USUALLY((uint32_t)fx_dot2(v_pair, v_pair) < config->clear_q30)) {
        *state = next;
        return (current_control_out_t){.u = u, .v = v_pair, .clear = true};
    }
    const dq_q15_t limited = limit_to_circle(v, error_d, omega);
    const dq_q15_t change = {limited.d - v.d, limited.q - v.q};
    const int32_t gain_q33 = fx_mul_q31_word(config->tracking_gain_q34, in->v_dc); /* per unit of v: Q34 * Q15 */
    *state = (current_control_state_t){anti_windup(next.s_d_q30, gain_q33, change.d),
                                       anti_windup(next.s_q_q30, gain_q33, change.q)};
    return (current_control_out_t){
        .u = u,
        .v = fx_pair(limited.d, limited.q),
        .limited = (uint32_t)(change.d | change.q),
    };
}
