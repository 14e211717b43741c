/* SPDX-License-Identifier: Apache-2.0 */
#include "control/current_control.h"

#include "fx/q.h"
#include "fx/sqrt.h"

/* The d axis comes first, but never takes all: with no room at all the q axis could not shed the flux that
 * binds the d axis, and both would stay where they are. 31/32 leave it a quarter of the circle (CC-11). */
#define D_RESERVE_SHIFT 5
#define HALF_LSB_Q22 64

typedef struct {
    int32_t error; /* psi* - psi, Q15 */
    int32_t u;     /* before the limiter, Q22 */
} axis_t;

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

/* One axis without limits: u = sigma (f - psi) + s + feed-forward (CC-4), and half an LSB to round q15.
 * Q24 * Q30 = Q22; the difference of two q15 numbers fits Q30. */
static axis_t axis(int32_t sigma_q24, int32_t target, int32_t weighted_q30, int32_t psi, int32_t slow_q30)
{
    return (axis_t){
        .error = target - psi,
        .u = fx_mulhi_add(HALF_LSB_Q22, sigma_q24, weighted_q30 - psi * 32768) + (slow_q30 >> 8),
    };
}

/* The whole vector shortened, its direction kept up to 2 pu per axis. */
static dq_t shortened(int32_t d_q22, int32_t q_q22, int32_t v_max)
{
    const int32_t d = fx_sat_bits(d_q22, 24) * 128; /* Q29 */
    const int32_t q = fx_sat_bits(q_q22, 24) * 128;
    const uint32_t square = (uint32_t)fx_mulhi_add(fx_mulhi(d, d), q, q); /* Q26, below 2^29 */
    if (square == 0U) {
        return (dq_t){0, 0};
    }
    const unsigned shift = (unsigned)__builtin_clz(square) & 30U;
    const int32_t inverse = fx_rsqrt_normalised(square << shift);
    /* v_max/|u| <= 1: as |u| 2^(shift/2) is below 2^16 in Q13, v_max with as many bits is below 2^18 in Q15. */
    const int32_t share = fx_mulhi((v_max << (shift >> 1)) << 12, inverse); /* Q27 */
    return (dq_t){fx_shr_round(fx_mulhi(d, share), 9), fx_shr_round(fx_mulhi(q, share), 9)};
}

/* d first, at most 31/32 of the circle; q what is left (CC-11), less what d is short of: so the flux psi_q that binds
 * d goes (CC-14). */
static dq_t d_first(int32_t d, int32_t q, int32_t v_max, bool backwards)
{
    const int32_t d_max = v_max - (v_max >> D_RESERVE_SHIFT);
    const int32_t u_d = fx_clamp_q31(d, -d_max, d_max);
    const int32_t q_max = fx_sqrt_q30((uint32_t)(v_max * v_max - u_d * u_d));
    const int32_t missing = d - u_d;
    return (dq_t){u_d, fx_clamp_q31(q + (backwards ? -missing : missing), -q_max, q_max)};
}

/* s += a T_s (u_limited - u): what the circle cut away is no error to be integrated (CC-10). Q15 * Q15 = Q30, a gain
 * below 1/2 times less than 1. */
static int32_t track(int32_t s_q30, int32_t gain, int32_t missing)
{
    return fx_sat_bits(s_q30 + gain * fx_sat_q15_word(missing), 31);
}

/* s += sigma a_i e: Q15 * Q15 = Q30 with a gain below 1/2. |s| <= 1, so that slow and rotational voltage fit Q30. */
static int32_t integrate(int32_t s_q30, int32_t gain, int32_t error)
{
    return fx_sat_bits(s_q30 + gain * error, 31);
}

/* Nothing to be cut: on the circle or inside, and d leaves q its quarter, 1 - (31/32)^2 < 1/16 (CC-11). */
static bool inside(const current_control_config_t *config, fx_pair_t u, int32_t d, int32_t v_dc)
{
    const int32_t v_max = (config->v_ratio * v_dc + 0x4000) >> 15;
    const int32_t most = v_max * v_max;
    return fx_dot2(u, u) <= most && d * d <= most - (most >> 4);
}

/* Beyond the circle, or nearly, the d axis comes
 * first while it takes flux away (CC-11). While it asks for flux back, the q axis may be what holds that flux: a cut
 * that served d first would leave both where they are, at any torque. What was cut goes to the integrators as well. */
static __attribute__((noinline)) fx_pair_t cut(const current_control_config_t *config, current_control_state_t *state,
                                               int32_t d_q22, int32_t q_q22, int32_t v_dc, int32_t error_d,
                                               bool backwards)
{
    const bool more_flux = error_d > 0;
    const int32_t d = d_q22 >> 7;
    const int32_t q = q_q22 >> 7;
    const int32_t v_max = (config->v_ratio * v_dc + 0x4000) >> 15;
    const int32_t s_d = fx_sat_q15_word(d);
    const int32_t s_q = fx_sat_q15_word(q);
    const int32_t room = v_max * v_max - s_d * s_d; /* Q30 */
    const int32_t room_min = more_flux ? 0 : (v_max * v_max) >> 4;
    if (s_q * s_q <= room && room >= room_min) {
        return fx_arch_pkhbt(s_d, s_q);
    }
    const dq_t u = more_flux ? shortened(d_q22, q_q22, v_max) : d_first(d, q, v_max, backwards);
    state->s_d_q30 = track(state->s_d_q30, config->tracking_gain, u.d - d);
    state->s_q_q30 = track(state->s_q_q30, config->tracking_gain, u.q - q);
    return fx_arch_pkhbt(u.d, u.q);
}

current_control_out_t current_control_step(const current_control_config_t *config, current_control_state_t *state,
                                           const current_control_in_t *in)
{
    const dq_t psi = {in->flux->psi_d, in->flux->psi_q};
    const current_target_t to = *in->target;
    const current_control_state_t s = *state;
    const int32_t omega = in->omega >> 16;
    const int32_t psi_d = fx_sat_q15_word(psi.d + in->psi_delta);
    /* |s| <= 1 and |w psi| <= 1: at most 2^31 - 1. */
    const axis_t d = axis(config->sigma_q24, to.psi.d, to.weighted_q30.d, psi.d,
                          s.s_d_q30 - omega * psi.q);
    const axis_t q = axis(config->sigma_q24, to.psi.q, to.weighted_q30.q, psi.q,
                          s.s_q_q30 + omega * psi_d);
    const dq_t u = {fx_sat_q15_word(d.u >> 7), fx_sat_q15_word(q.u >> 7)};
    *state = (current_control_state_t){integrate(s.s_d_q30, config->integral_gain, d.error),
                                       integrate(s.s_q_q30, config->integral_gain, q.error)};

    const fx_pair_t both = fx_arch_pkhbt(u.d, u.q);
    if ((uint32_t)fx_dot2(both, both) < (uint32_t)fx_mulhi(config->clear_q32, in->v_dc * in->v_dc)) {
        return (current_control_out_t){.u = u, .clear = true};
    }
    if (inside(config, both, u.d, in->v_dc)) {
        return (current_control_out_t){.u = u};
    }
    const fx_pair_t left = cut(config, state, d.u, q.u, in->v_dc, d.error, omega < 0);
    const dq_t is = {(int16_t)(left & 0xFFFFU), (int16_t)(left >> 16)};
    return (current_control_out_t){.u = is, .limited = left != both};
}
