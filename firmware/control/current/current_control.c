/* SPDX-License-Identifier: Apache-2.0 */
#include "control/current/current_control.h"

#include "fx/circle.h"
#include "fx/codegen.h"
#include "fx/div.h"
#include "fx/q.h"

#define HALF_LSB_Q22 64
#define V_D_MIN Q15(0.7)                     /* share of the circle that the d axis may usually use (CC-11) */
#define V_D_LEAST (127 * 128 + 64)           /* 0.498: the same while q is far from its flux; the middle of a cell */
#define V_Q_FAR 49152                        /* v_q = 1.5, q15: the q axis is far from its flux (CC-11) */
#define CIRCLE_SHIFT 7                       /* 256 cells of the circle's table */
#define V_Q_LEAVES_MIN (182 * 128)           /* from here on, q15, the circle's cells leave d less than V_D_MIN */
#define INSIDE_CIRCLE_Q30 (127 << 23)        /* |v|^2 = 127/128: below, no cell of the circle's table limits v */
#define REACHED_SHIFT 4                      /* psi_f/16: what is left of a change is made at once (CC-25) */

/* Two halfwords that lie side by side, by one load. */
static fx_pair_t pair_of(q15_t low, q15_t high)
{
    return (uint16_t)low | ((uint32_t)(uint16_t)high << 16);
}

/* psi* - (1 - b)(l i*), where l i* is psi* minus the magnet's flux (CC-5). Q31 * Q16 = Q15. */
static inline int32_t weighted_flux(int32_t weight_q31, int32_t psi, int32_t psi_magnet)
{
    return psi_magnet + fx_mulhi(weight_q31, 2 * (psi - psi_magnet));
}

/* f, Q30: the weighted flux, the resistive drop and a rotational voltage as flux errors. Q16 * Q31 = Q15. */
static inline int32_t proportional_reference(int32_t weighted, q16_t drop_gain, int32_t i_ref, int32_t turned_q30)
{
    const int32_t with_drop = fx_sat_q15_word(weighted + fx_mulhi(drop_gain, i_ref * 65536));
    return fx_sat_bits(with_drop * 32768 + turned_q30, 31);
}

/* Whether x is outside [-limit, limit]. */
static inline bool is_beyond(int32_t x, int32_t limit)
{
    return x > limit || x < -limit;
}

/* (CC-25) */
static inline void follow(rotating_flux_t *rotating, dq_q15_t to, int32_t psi_magnet)
{
    dq_q15_t left = {to.d - rotating->psi.d, to.q - rotating->psi.q};
    const int32_t at_once = rotating->behind ? psi_magnet >> REACHED_SHIFT : psi_magnet - (psi_magnet >> 2);
    const int shift = rotating->behind ? 2 : 1;
    rotating->behind = is_beyond(left.d, at_once) || is_beyond(left.q, at_once);
    if (rotating->behind) {
        to.d -= left.d >> shift;
        to.q -= left.q >> shift;
    }
    rotating->psi.d = fx_sat_q15_word(to.d);
    rotating->psi.q = fx_sat_q15_word(to.q);
}

FX_COLD current_target_t current_control_target(const current_control_config_t *config, const operating_point_t *at,
                                                int32_t psi_d_error, rotating_flux_t *rotating)
{
    const int32_t weight_q31 = config->setpoint_weight * 65536;
    const int32_t integral_gain = config->integral_gain;
    const q16_t drop_gain = config->drop_gain;
    const int32_t weighted_d = weighted_flux(weight_q31, at->flux.psi_d, at->flux.psi_f0);
    const int32_t weighted_q = weighted_flux(weight_q31, at->flux.psi_q, 0);
    int32_t turn_q31 = at->omega >> 31;
    int32_t rest = 0;
    const int32_t sigma_q16 = config->sigma_q24 >> 8;
    if (sigma_q16 != 0) { /* with current_control_turning.h only the sign of the speed acts */
        turn_q31 = (at->omega >> 5) * MEASURED_SHARE_Q5;
        rest = fx_sat_q15_word((at->omega - turn_q31) / sigma_q16); /* Q31/Q16 */
    }
    follow(rotating, (dq_q15_t){weighted_d, weighted_q}, at->flux.psi_f0);
    const int32_t with_magnet = fx_sat_q15_word(rotating->psi.d + psi_d_error);
    return (current_target_t){
        .psi = {(q15_t)at->flux.psi_d, (q15_t)at->flux.psi_q},
        .weighted = {proportional_reference(weighted_d, drop_gain, at->i.d, -(rest * rotating->psi.q)),
                     proportional_reference(weighted_q, drop_gain, at->i.q, rest * with_magnet)},
        .turn = turn_q31 >> 16,
        .integral_turn = (q15_t)((integral_gain * rest) >> 15),
        .integral_gain = (q15_t)integral_gain,
    };
}

/* One axis before the limit: u = sigma (f - psi) + s + feed-forward (CC-4), the last two summed in s_and_ff. Q24 * Q30
 * = Q22; the difference of two q15 numbers fits Q30. */
static int32_t unlimited_voltage(int32_t sigma_q24, int32_t weighted_q30, int32_t psi, int32_t s_and_ff_q30)
{
    return fx_mulhi_add(s_and_ff_q30 >> 8, sigma_q24, weighted_q30 - psi * 32768);
}

/* s += a_i (sigma + j w') e: Q15 * Q15 = Q30 with gains below 1/2. |s| <= 1, so that the sum of s and the rotational
 * voltage fits Q30. gains: of the turned error, of the error. */
static void integrate(current_control_state_t *state, current_control_state_t s, fx_pair_t gains, fx_pair_t error)
{
    *state = (current_control_state_t){fx_sat_bits(fx_difference2_cross_acc(s.s_d_q30, error, gains), 31),
                                       fx_sat_bits(fx_dot2_acc(s.s_q_q30, error, gains), 31)};
}

/* 1/(v_ratio v_dc), Q25 (CC-15), at most 64. Q31/Q15 = Q16. */
static int32_t reciprocal_v_max(const current_control_config_t *config, int32_t v_dc)
{
    return fx_usat_bits(fx_quotient(config->per_ratio_q31, (uint32_t)v_dc), 22) * 512;
}

/* Back from the magnitude by the ones' complement, with which one comparison with a limit is enough. */
static int32_t with_sign_of(int32_t magnitude, int32_t x)
{
    return magnitude ^ (x >> 31);
}

/* Clamps to [-limit - 1, limit]. */
static int32_t clamp_symmetric(int32_t x, int32_t limit)
{
    return with_sign_of(fx_min_s32(fx_ones_magnitude(x), limit), x);
}

/* Largest voltage of one axis inside the unit circle, given the other's magnitude; at least a quarter (CC-11). */
static int32_t remaining_voltage(const uint16_t *circle, int32_t other)
{
    return circle[other >> CIRCLE_SHIFT];
}

/* The same for the d axis, at least V_D_MIN, or V_D_LEAST where q alone would need V_Q_FAR. The q voltage is compared
 * with the first cell that leaves less, which saves reading the table there. */
static int32_t remaining_for_d(const uint16_t *circle, int32_t q)
{
    if (q < V_Q_LEAVES_MIN) {
        return remaining_voltage(circle, q);
    }
    return (q < V_Q_FAR) ? V_D_MIN : V_D_LEAST;
}

/* The d axis has priority while its flux is to fall and its voltage is negative, because cutting this voltage would
 * let the flux rise. Otherwise d gets what q leaves of the circle: the q flux may be what limits the d axis. The d
 * axis keeps 0.7 or half, or else its flux would fall further and i_d would grow (CC-11). What the d axis lacks is
 * subtracted from q: only a smaller q flux gives the d axis its voltage (CC-14). error_d: only the sign acts. */
static dq_q15_t limit_to_circle(dq_q15_t v, int32_t error_d, int32_t turn)
{
    const uint16_t *circle = fx_circle_table;
    FX_ADDRESS_ONCE(circle);
    int32_t magnitude_d = fx_ones_magnitude(fx_sat_q15_word(v.d));
    if ((v.d & error_d) >= 0) {
        magnitude_d = fx_min_s32(magnitude_d, remaining_for_d(circle, fx_ones_magnitude(v.q)));
    }
    const int32_t d = with_sign_of(magnitude_d, v.d);
    const int32_t excess = fx_sat_q15_word(v.d - d);
    const int32_t sign = turn >> 31; /* 0 or -1: with two's complement an excess of 0 changes nothing */
    const int32_t q = v.q + (excess ^ sign) - sign;
    return (dq_q15_t){d, clamp_symmetric(q, remaining_voltage(circle, magnitude_d))};
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
    const current_target_t *to = in->target;
    const fx_two_words_t integrators = FX_LOAD_TWO(state, s_d_q30, s_q_q30);
    const current_control_state_t s = {integrators.first, integrators.second};
    const fx_pair_t error = fx_pair_sub(pair_of(to->psi.d, to->psi.q), fx_pair(psi.d, psi.q));
    const int32_t turn = to->turn;
    /* |s| <= 1 and |m w psi| <= 1: at most 2^31 - 1. */
    const dq_q22_t u_q22 = {unlimited_voltage(config->sigma_q24, to->weighted.d, psi.d, s.s_d_q30 - turn * psi.q),
                            unlimited_voltage(config->sigma_q24, to->weighted.q, psi.q, s.s_q_q30 + turn * psi.d)};
    integrate(state, s, pair_of(to->integral_turn, to->integral_gain), error);
    const dq_q15_t u = {fx_sat_q15_word((u_q22.d + HALF_LSB_Q22) >> 7), fx_sat_q15_word((u_q22.q + HALF_LSB_Q22) >> 7)};

    const int32_t per_v_max_q25 = reciprocal_v_max(config, in->v_dc);
    /* Q25 * Q22 = Q15, below 2^30. */
    const dq_q15_t v = {fx_mulhi(per_v_max_q25, u_q22.d), fx_mulhi(per_v_max_q25, u_q22.q)};
    const fx_pair_t v_pair = fx_pair(fx_sat_q15_word(v.d), fx_sat_q15_word(v.q));
    const uint32_t squared_q30 = (uint32_t)fx_dot2(v_pair, v_pair);
    if (FX_USUALLY(squared_q30 < INSIDE_CIRCLE_Q30)) { /* the limiter would not change it, but take 40 instructions */
        return (current_control_out_t){.u = u, .v = v_pair, .clear = squared_q30 < config->clear_q30};
    }
    const dq_q15_t limited = limit_to_circle(v, (int32_t)(error << 16), to->turn);
    const dq_q15_t change = {limited.d - v.d, limited.q - v.q};
    const int32_t gain_q33 = fx_mul_q31_word(config->tracking_gain_q34, in->v_dc); /* per unit of v: Q34 * Q15 */
    const fx_two_words_t next = FX_LOAD_TWO(state, s_d_q30, s_q_q30);
    *state = (current_control_state_t){anti_windup(next.first, gain_q33, change.d),
                                       anti_windup(next.second, gain_q33, change.q)};
    return (current_control_out_t){
        .u = u,
        .v = fx_pair(limited.d, limited.q),
        .limited = (uint32_t)(change.d | change.q),
    };
}
