/* SPDX-License-Identifier: Apache-2.0 */
#include "control/identify.h"

#include "control/identify_q30.h"
#include "fx/div.h"

#define PER_STEP 429496730 /* 2^32/IDENTIFY_STEPS */
#define REFERENCE_dC 200   /* 20 C */
#define CONTRADICTION_RATE Q15(0.1)
#define CONTRADICTION_MAX Q15(0.5)
#define NOISE_MIN (1 << 19) /* its square is the smallest divisor of the filter */
#define LIMITED_SHIFT 1 /* every period with snapped pulses adds half of the noise */

typedef struct {
    dq_t psi, i; /* identified, Q30 */
    int32_t magnet; /* psi_d minus the tables', what the current control uses */
} operating_t;

bool identify_valid(const identify_config_t *c)
{
    bool good = c->r0 > 0 && c->rate_gain_q28 > 0 && c->window_turns_q29 > 0 && c->turn_to_pu > 0 &&
                c->noise_voltage_q30 >= NOISE_MIN && c->noise_flux_q30 >= 0 && c->noise_rate_q30 >= 0 &&
                c->r_known_q30 > 0 && c->r_known_q30 <= IDENTIFY_ONE_Q30 && c->l_shift <= 14;
    good = good && c->omega_min > 0 && c->i_min > 0 && c->i_smooth > 0 && c->i_smooth <= c->i_min &&
           c->local_corner > 0 && c->local_rate > 0 && c->torque_min > 0 && c->confidence_rate > 0 &&
           c->confidence_full > 0 && c->confidence_full < c->confidence_none;
    for (unsigned j = 0; j < IDENTIFY_STATES; j++) {
        good = good && c->sigma[j] > 0 && c->leak[j] > 0 && c->leak[j] <= Q31(0.25);
    }
    return good;
}

void identify_reset(const identify_config_t *config, identify_state_t *state)
{
    *state = (identify_state_t){.r_prior = config->r0};
    identify_filter_reset(&state->filter);
}

q31_t identify_value(const identify_config_t *config, const identify_state_t *state, identify_index_t index)
{
    return fx_shl_q31(fx_mulhi(config->sigma[index], state->filter.x[index]), 5); /* Q31 * Q27 = Q26 */
}

/* R = r0 (1 + alpha (theta - 20 C)); without a sensor the last one holds (ID-13). */
static void resistance_prior(const identify_config_t *config, identify_state_t *state, const identify_in_t *in)
{
    state->r_known = in->temperature_known;
    if (in->temperature_known) {
        state->r_prior = fx_sat_q31(config->r0 + (int64_t)config->r_per_dC * (in->winding_dC - REFERENCE_dC));
    }
}

/* Standard deviation of the residuals as the filter shall see it (ID-14): voltage, flux and its change. */
static int32_t noise(const identify_config_t *config, const identify_point_t *point)
{
    const int32_t change = fx_add_q31(fx_abs_q31(point->rate.d), fx_abs_q31(point->rate.q));
    const int32_t level = fx_add_q31(config->noise_voltage_q30,
                                     fx_add_q31(identify_mul(fx_abs_q31(point->omega / 2), config->noise_flux_q30),
                                                identify_mul(change, config->noise_rate_q30)));
    return fx_sat_q31(level + (((int64_t)level * point->limited) >> LIMITED_SHIFT));
}

static void collect_row(identify_row_t *mean, const identify_row_t *row)
{
    for (unsigned j = 0; j < IDENTIFY_STATES; j++) {
        mean->h[j] = fx_mulhi_add(mean->h[j], row->h[j], PER_STEP);
    }
}

static void collect(const identify_config_t *config, identify_state_t *state, const identify_in_t *in,
                    const identify_model_t *model, dq_t e)
{
    state->learn = (state->learn || state->steps == 0U) && in->point->valid && model->current && in->enabled;
    collect_row(&state->mean_d, &model->d);
    collect_row(&state->mean_q, &model->q);
    state->mean_e.d = fx_mulhi_add(state->mean_e.d, e.d, PER_STEP);
    state->mean_e.q = fx_mulhi_add(state->mean_e.q, e.q, PER_STEP);
    state->mean_noise_q30 = fx_mulhi_add(state->mean_noise_q30, noise(config, in->point), PER_STEP);
    state->steps++;
}

/* Both axes, one after the other: the second sees what the first has learnt. */
static void learn(identify_state_t *state)
{
    const int64_t r = (int64_t)state->mean_noise_q30 * state->mean_noise_q30;
    const int32_t before = identify_filter_shift(&state->filter, &state->mean_q);
    const identify_verdict_t d = identify_filter_update(&state->filter, &state->mean_d, state->mean_e.d, r);
    const int32_t moved = fx_sub_q31(identify_filter_shift(&state->filter, &state->mean_q), before);
    const identify_verdict_t q =
        identify_filter_update(&state->filter, &state->mean_q, fx_sub_q31(state->mean_e.q, moved), r);
    state->clamped = d.clamped || q.clamped;
    const int32_t target = (d.inconsistent || q.inconsistent || state->clamped) ? Q15_MAX : 0;
    state->contradiction = fx_add_q15(state->contradiction,
                                      fx_mul_q15(CONTRADICTION_RATE, fx_sat_q15(target - state->contradiction)));
}

/* Torque uncertainty against two levels: well below what the tables alone have, or small against the torque; between
 * the levels the last decision holds (ID-18). That no torque is certain to be no torque is no reason to trust. */
static void judge(const identify_config_t *config, identify_state_t *state, const identify_model_t *model,
                  q15_t torque)
{
    const identify_row_t row = identify_torque_row(config, model);
    const int64_t variance = identify_filter_variance(&state->filter, &row); /* Q60 */
    const int64_t prior = identify_filter_prior(&row);
    const q15_t size = fx_abs_q15(torque);
    const q15_t scale = (q15_t)fx_max_s32(size, config->torque_min);
    const int64_t full = (int64_t)fx_mul_q30(size, config->confidence_full); /* Q30 */
    const int64_t none = (int64_t)fx_mul_q30(scale, config->confidence_none);
    const bool good = variance < (prior >> 2) + (prior >> 3) || variance < full * full;
    const bool bad = variance > prior - (prior >> 2) && variance > none * none;
    if (bad || state->contradiction > CONTRADICTION_MAX) {
        state->trusted = false;
    } else if (good) {
        state->trusted = true;
    }
    const int32_t step = state->trusted ? config->confidence_rate : -config->confidence_rate;
    state->confidence = (q15_t)fx_clamp_q31(state->confidence + step, 0, Q15_MAX);
}

static void update(const identify_config_t *config, identify_state_t *state, const identify_model_t *model,
                   q15_t torque)
{
    if (state->learn) {
        learn(state);
    }
    identify_filter_leak(config, &state->filter, state->r_known);
    judge(config, state, model, torque);
    state->mean_d = (identify_row_t){{0}};
    state->mean_q = (identify_row_t){{0}};
    state->mean_e = (dq_t){0, 0};
    state->mean_noise_q30 = 0;
    state->steps = 0;
}

/* w/(w^2 + w_x^2) times the residual, into a first-order filter (ID-16). */
static void localise(const identify_config_t *config, identify_state_t *state, const identify_in_t *in, dq_t e)
{
    dq_t target = {0, 0};
    if (in->point->valid && in->enabled) {
        const q15_t w = fx_q15_from_q31(in->point->omega);
        const int32_t square = fx_mul_q30(w, w) + fx_mul_q30(config->local_corner, config->local_corner);
        const q16_t gain = in->point->omega / fx_max_s32(square >> 15, 1); /* Q31/Q15 */
        target = (dq_t){fx_mul_gain_q31(gain, e.q), fx_neg_q31(fx_mul_gain_q31(gain, e.d))};
    }
    state->local.d += fx_mul_q31(config->local_rate, fx_sub_q31(target.d, state->local.d));
    state->local.q += fx_mul_q31(config->local_rate, fx_sub_q31(target.q, state->local.q));
}

/* The tables' flux and magnetising current with everything that is known by now (ID-15). */
static operating_t correct(const identify_config_t *config, const identify_state_t *state, const identify_model_t *m)
{
    dq_t shift = state->local;
    int32_t value[IDENTIFY_STATES];
    for (unsigned j = 0; j < IDENTIFY_STATES; j++) {
        value[j] = identify_value(config, state, (identify_index_t)j) >> 1;
        shift.d = fx_add_q31(shift.d, identify_mul(value[j], m->psi_d.h[j]));
        shift.q = fx_add_q31(shift.q, identify_mul(value[j], m->psi_q.h[j]));
    }
    const int32_t iron = value[IDENTIFY_IRON];
    const int32_t magnet = fx_add_q31(value[IDENTIFY_FLUX], identify_mul(value[IDENTIFY_LD], m->psi_d.h[IDENTIFY_LD]));
    return (operating_t){
        .psi = {fx_add_q31(m->psi.d, fx_add_q31(shift.d, value[IDENTIFY_FLUX])), fx_add_q31(m->psi.q, shift.q)},
        .i = {m->i_m.d + identify_mul(iron, m->iron_i.d), m->i_m.q + identify_mul(iron, m->iron_i.q)},
        .magnet = magnet,
    };
}

identify_out_t identify_step(const identify_config_t *config, identify_state_t *state, const identify_in_t *in)
{
    resistance_prior(config, state, in);
    identify_model_t model;
    identify_model(config, in->point, in->tables, state->r_prior, &model);
    const dq_t e = {fx_sub_q31(model.y.d, identify_filter_shift(&state->filter, &model.d)),
                    fx_sub_q31(model.y.q, identify_filter_shift(&state->filter, &model.q))};
    localise(config, state, in, e);
    collect(config, state, in, &model, e);
    const operating_t now = correct(config, state, &model);
    const int32_t torque =
        identify_mean_torque(config, &in->tables->inductances, in->point->chord, now.psi, now.i);
    const identify_out_t out = {fx_round_q15(torque), fx_round_q15(now.magnet)};
    if (state->steps >= IDENTIFY_STEPS) {
        update(config, state, &model, out.torque);
    }
    return out;
}
