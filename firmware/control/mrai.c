/* SPDX-License-Identifier: Apache-2.0 */
#include "control/mrai.h"

#include "fx/q.h"

/* The slow observer poles make e = w dpsi/(S L_q) large: 0.8 pu for a magnet 15 % weak at full speed on hsm1. A
 * tighter bound winds up. */
#define ERROR_BITS 31
/* |s2 e| < 1/16 in the laws: 5 more bits fit, and the small steps of the adaptation keep theirs. */
#define INNOVATION_BITS 26
#define INNOVATION_SCALE 32
#define PROPORTIONAL_MAX (128 * Q16_ONE - 1)

typedef struct {
    int32_t d, q;
} pair_t;

/* Over the period: half the sum of two q15 values in Q31, two q15 values in Q30. */
typedef struct {
    pair_t g;     /* Q31 */
    pair_t i;     /* Q30, measured */
    pair_t i_hat; /* Q30, i - e: of the observer */
    pair_t s2e;   /* Q29, weighted error */
} mean_t;

typedef struct {
    q31_t lo, hi;
    q16_t proportional;
} law_t;

bool mrai_valid(const mrai_config_t *config)
{
    const bool gains = config->r0 > 0 && config->pole_gain > 0 && config->pole_gain <= Q31(0.25) &&
                       config->flux_gain >= 0 && config->resistance_gain >= 0 &&
                       config->resistance_gain <= Q31(1.0 / 32.0) && config->flux_proportional >= 0 &&
                       config->flux_proportional <= PROPORTIONAL_MAX && config->resistance_proportional >= 0 &&
                       config->resistance_proportional <= PROPORTIONAL_MAX;
    const bool limits = config->psi_delta_min < config->psi_delta_max && config->r_delta_min < config->r_delta_max &&
                        config->psi_delta_min >= Q31(-0.5) && config->psi_delta_max <= Q31(0.5) &&
                        config->r_delta_min >= Q31(-0.5) && config->r_delta_max <= Q31(0.5);
    return gains && limits && config->rate_gain_q26 > 0 && config->omega_min > 0 && config->l_shift <= 14 &&
           config->psi_drift_full > 0 && config->r_drift_full > 0;
}

static void remember(mrai_state_t *state, const mrai_in_t *in)
{
    state->i = in->i;
    state->u = in->u;
    state->psi = (dq_t){in->flux.psi_d, in->flux.psi_q};
    state->g = (dq_t){in->flux.g_d, in->flux.g_q};
}

void mrai_reset(mrai_state_t *state, const mrai_in_t *in)
{
    state->e_d_q30 = 0;
    state->e_q_q30 = 0;
    state->psi_used = state->psi_delta;
    state->r_used = state->r_delta;
    remember(state, in);
}

/* s2 e in Q29 (MR-7): the pole placement makes s2 = m R_0/2 (g_d + g_q) the only gain of the correction. */
static pair_t weighted_error(const mrai_config_t *config, pair_t g, pair_t e)
{
    /* Q31 * Q31 = Q30, below 1/2 by mrai_valid(), so that one more bit fits. */
    const q31_t s2 = fx_mulhi_add(fx_mulhi(config->pole_gain, g.d), config->pole_gain, g.q) * 2;
    return (pair_t){fx_mulhi(s2, e.d), fx_mulhi(s2, e.q)};
}

/* One law: I -= step, clamped; the proportional part acts on top of it for this step only (MR-9, MR-10). */
static bool adapt(const law_t *law, q31_t *integral, q31_t *used, q31_t step)
{
    const q31_t moved = fx_sub_q31(*integral, step);
    const q31_t kept = fx_clamp_q31(moved, law->lo, law->hi);
    /* Q31 * Q24 = Q23; limited to 1/2 pu so that the sum with the limited integral cannot overflow. */
    const int32_t proportional = fx_sat_bits(fx_mulhi(step, law->proportional * 256), 23);
    *integral = kept;
    *used = kept - proportional * 256;
    return moved != kept;
}

/* (8) normalised: dpsi -= 2 k_psi s2 (l_q/w) e_q. Q34 * Q31 = Q33, * Q28 = Q29; |step| < 2^28 leaves two bits. */
static void adapt_flux(const mrai_config_t *config, const mrai_schedule_t *schedule, mrai_state_t *state, int32_t l_qq,
                       int32_t innovation_q)
{
    const law_t law = {config->psi_delta_min, config->psi_delta_max, config->flux_proportional};
    const q31_t step = fx_mulhi(schedule->flux_step_q28, fx_mulhi(innovation_q, l_qq * 65536)) * 4;
    state->psi_clamped = adapt(&law, &state->psi_delta, &state->psi_used, step);
}

/* (7) normalised: dR -= k (i_d~ s2 e_d g_d + i_q~ s2 e_q g_q). Q34 * Q30 = Q32, * Q31 = Q31, * Q26 = Q25. */
static void adapt_resistance(const mrai_config_t *config, const mrai_schedule_t *schedule, mrai_state_t *state,
                             pair_t g, pair_t i_hat, pair_t innovation)
{
    const law_t law = {config->r_delta_min, config->r_delta_max, config->resistance_proportional};
    const int32_t d = fx_mulhi(fx_mulhi(innovation.d, i_hat.d), g.d);
    const int32_t q = fx_mulhi(fx_mulhi(innovation.q, i_hat.q), g.q);
    const int32_t step_q25 = fx_mulhi(schedule->resistance_step_q26, d + q); /* |d|, |q| < 2^28 */
    state->r_clamped = adapt(&law, &state->r_delta, &state->r_used, fx_sat_bits(step_q25, 25) * 64);
}

/* u/sinc + rotational - drop on one axis, mean over the period, Q30, saturating; the drop in Q29 is taken twice. */
static int32_t driving_voltage(int32_t u, int32_t gain, int32_t drop, int32_t rotational)
{
    return fx_sub2_q31(fx_add_q31(u * (0x8000 + gain), rotational), drop);
}

/* dpsi/T_s of one axis: Q26 * Q31 = Q25, limited to 1 pu and brought to Q30. */
static int32_t flux_rate(const mrai_config_t *config, int32_t now, int32_t last)
{
    return fx_sat_bits(fx_mulhi(config->rate_gain_q26, fx_sat_q15_word(now - last) * 65536), 26) * 32;
}

/* e + g x + correction; x in Q30, both terms in Q29 and counted twice. */
static int32_t advance(int32_t e, int32_t x, q31_t g, int32_t correction_q29)
{
    return fx_sat_bits(fx_add2_q31(e, fx_mulhi_add(correction_q29, x, g)), ERROR_BITS);
}

/* R_0 i + dR i~ (MR-6): R_0 acts on the measured current, else it would add its own R_0/L to the placed poles. Q29. */
static int32_t resistive_drop(const mrai_config_t *config, q31_t r_used, int32_t i, int32_t i_hat)
{
    return fx_mulhi_add(fx_mulhi(r_used, i_hat), config->r0, i);
}

/* The voltage equation over the period that ends with this sample (MR-6); trapezoidal means make it exact in steady
 * state. */
static void observe(const mrai_config_t *config, int32_t voltage_gain, mrai_state_t *state, const mrai_in_t *in,
                    const mean_t *mean)
{
    const flux_point_t *flux = &in->flux;
    const q31_t psi_d = fx_add_q31((flux->psi_d + state->psi.d) * 32768, state->psi_used);
    const int32_t v_d = fx_mulhi(in->omega, (flux->psi_q + state->psi.q) * 32768);
    const int32_t v_q = -fx_mulhi(in->omega, psi_d);
    const int32_t drop_d = resistive_drop(config, state->r_used, mean->i.d, mean->i_hat.d);
    const int32_t drop_q = resistive_drop(config, state->r_used, mean->i.q, mean->i_hat.q);
    const int32_t x_d = fx_sub_q31(flux_rate(config, flux->psi_d, state->psi.d),
                                   driving_voltage(state->u.d, voltage_gain, drop_d, v_d));
    const int32_t x_q = fx_sub_q31(flux_rate(config, flux->psi_q, state->psi.q),
                                   driving_voltage(state->u.q, voltage_gain, drop_q, v_q));
    state->e_d_q30 = advance(state->e_d_q30, x_d, mean->g.d, mean->s2e.q - mean->s2e.d);
    state->e_q_q30 = advance(state->e_q_q30, x_q, mean->g.q, -mean->s2e.d - mean->s2e.q);
}

void mrai_step(const mrai_config_t *config, const mrai_schedule_t *schedule, mrai_state_t *state, const mrai_in_t *in)
{
    const pair_t e = {state->e_d_q30, state->e_q_q30};
    mean_t mean;
    mean.g = (pair_t){(in->flux.g_d + state->g.d) * 32768, (in->flux.g_q + state->g.q) * 32768};
    mean.i = (pair_t){(in->i.d + state->i.d) * 16384, (in->i.q + state->i.q) * 16384};
    mean.i_hat = (pair_t){mean.i.d - e.d, mean.i.q - e.q};
    mean.s2e = weighted_error(config, mean.g, e);
    const pair_t innovation = {fx_sat_bits(mean.s2e.d, INNOVATION_BITS) * INNOVATION_SCALE,
                               fx_sat_bits(mean.s2e.q, INNOVATION_BITS) * INNOVATION_SCALE};

    adapt_flux(config, schedule, state, in->flux.l_qq, innovation.q);
    adapt_resistance(config, schedule, state, mean.g, mean.i_hat, innovation);
    observe(config, schedule->voltage_gain, state, in, &mean);
    remember(state, in);
}
