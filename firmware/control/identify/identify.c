/* SPDX-License-Identifier: Apache-2.0 */
#include "control/identify/identify.h"

#include "control/identify/q30.h"
#include "fx/codegen.h"
#include "fx/div.h"
#include "signal/counter.h"

#define PER_STEP 429496730 /* 2^32/IDENTIFY_STEPS */
#define REFERENCE_dC 200   /* 20 C */
#define MISMATCH_MAX Q15(0.5)
#define GATE_EXCEEDED_MAX 25 /* ten times as many steps fit into a byte */
#define PREDICTION_STEP 2U   /* of the next update: spread, so that no step computes much more than the others */

typedef struct {
    identify_flux_t at; /* identified */
    int32_t magnet_q30; /* psi_d minus the tables', without the local error: for the current control */
} corrected_t;

void identify_reset(const identify_config_t *config, identify_state_t *state)
{
    *state = (identify_state_t){.kept.r_prior = config->r0, .torque_variance_q30 = Q31_MAX};
    kalman_reset(&state->kalman);
    identify_seal(state);
}

q31_t identify_value(const identify_config_t *config, const identify_state_t *state, identify_index_t index)
{
    return fx_sat_bits(fx_mulhi(config->sigma[index], state->kalman.x_q27[index]), 27) * 32; /* Q31 * Q27 = Q26 */
}

/* R = r0 (1 + alpha (theta - 20 C)); without a sensor the last one holds (ID-13). */
static void resistance_prior(const identify_config_t *config, identify_state_t *state, const identify_in_t *in)
{
    state->kept.r_known = temperature_is_known(in->winding_dC);
    if (state->kept.r_known) {
        state->kept.r_prior = fx_sat_q31(config->r0 + (int64_t)config->r_per_dC * (in->winding_dC - REFERENCE_dC));
    }
}

/* Standard deviation of the measurement noise (ID-14): errors of voltage, of flux and of its change. */
static int32_t measurement_noise(const identify_config_t *config, const identify_point_t *point)
{
    const int32_t change = fx_add_q31(fx_abs_q31(point->rate.d), fx_abs_q31(point->rate.q));
    const int32_t level = fx_add_q31(config->noise_voltage_q30,
                                     fx_add_q31(identify_mul(fx_abs_q31(point->omega) >> 1, config->noise_flux_q30),
                                                identify_mul(change, config->noise_rate_q30)));
    const int32_t factor = Q16_ONE + point->limited * config->limited_noise; /* up to 40 periods of 5/N */
    return fx_sat_q31((int64_t)level * factor >> 16);
}

/* Adds the step's share of each word of a measurement. */
static void add_to_mean(void *mean, const void *now)
{
    int32_t *to = mean;
    const int32_t *from = now;
    identify_add_share(to, from, sizeof(identify_measurement_t) / sizeof *to, PER_STEP);
}

static void average_step(const identify_config_t *config, identify_state_t *state, const identify_in_t *in,
                         identify_model_t *model)
{
    const bool step_valid = in->point->valid && model->current && in->enabled;
    state->kept.update_valid = (state->kept.update_valid || state->steps == 0U) && step_valid;
    model->now.noise_q30 = measurement_noise(config, in->point);
    add_to_mean(&state->mean, &model->now);
    state->steps++;
}

/* The measurement of one axis. Not inlined: one copy takes less memory. */
static FX_NOT_INLINED uint32_t update(identify_state_t *state, const jacobian_row_t *row, int32_t e_q30)
{
    identify_check_parameters(state);
    const uint32_t report = kalman_update(&state->kalman, row, e_q30, state->mean.noise_q30);
    identify_seal_parameters(state);
    return report;
}

/* Ends an update's ten steps. The q axis, whose turn is in the next step, takes the d axis into account. */
static void update_d_axis(identify_state_t *state)
{
    uint32_t report = 0;
    if (state->kept.update_valid) {
        identify_measurement_t *mean = &state->mean;
        const int32_t output_before = kalman_output(&state->kalman, &mean->q);
        report = update(state, &mean->d, mean->e.d);
        const int32_t change = fx_sub_q31(kalman_output(&state->kalman, &mean->q), output_before);
        mean->e.q = fx_sub_q31(mean->e.q, change);
        state->kept.clamped = (report & KALMAN_CLAMPED) != 0U;
    }
    const uint32_t exceeded = count_up_to(state->gate_exceeded_updates, GATE_EXCEEDED_MAX);
    state->gate_exceeded_updates = ((report & KALMAN_GATE_EXCEEDED) != 0U) ? (uint8_t)exceeded : 0U;
    state->steps = 0;
}

/* Before the first step of the next update. After a reset no measurement is valid. */
static void update_q_axis(const identify_config_t *config, identify_state_t *state)
{
    if (state->kept.update_valid) {
        const uint32_t report = update(state, &state->mean.q, state->mean.e.q);
        const bool exceeded = (report | state->gate_exceeded_updates) != 0U || state->kept.clamped; /* either axis */
        state->kept.clamped |= (report & KALMAN_CLAMPED) != 0U;
        const int32_t share = state->kept.mismatch_share; /* from 0 to 1 */
        const int32_t error = (exceeded ? Q15_MAX : 0) - share;
        state->kept.mismatch_share = fx_add_q15((q15_t)share, fx_mul_q15(config->mismatch_rate, error));
    }
    state->mean = (identify_measurement_t){.noise_q30 = 0};
}

/* The torque's variance is compared with two levels: well below the variance of the tables alone, or small against the
 * torque; between the levels the last decision holds (ID-18). At zero torque the relative test does not raise the
 * confidence: the variance of zero torque is small whatever the parameters are. */
static void update_confidence(const identify_config_t *config, identify_state_t *state, const identify_model_t *model,
                              int32_t torque)
{
    jacobian_row_t row;
    identify_torque_row(config, model, &row);
    const int64_t variance = kalman_output_variance(&state->kalman, &row); /* Q60 */
    state->torque_variance_q30 = fx_sat_q31(variance >> 30);
    const int64_t well_below = 3 * (kalman_output_variance_prior(&row) >> 3);
    const int32_t size = fx_abs_q15(torque);
    const int32_t full = size * config->confidence_full; /* Q30 */
    const int32_t none = fx_max_s32(size, config->torque_min) * config->confidence_none;
    bool certain = state->kept.torque_certain;
    if (state->kept.mismatch_share > MISMATCH_MAX || (variance > 2 * well_below && variance > (int64_t)none * none)) {
        certain = false;
    } else if (variance < well_below || variance < (int64_t)full * full) {
        certain = true;
    }
    state->kept.torque_certain = certain;
    const int32_t rate = config->confidence_rate;
    const int32_t step = certain ? rate : -rate;
    state->kept.confidence = (q15_t)fx_usat_q15_word(state->kept.confidence + step);
}

/* w/(w^2 + w_x^2) times the residual, into a first-order filter (ID-16). */
static void update_local_flux_error(const identify_config_t *config, identify_state_t *state, const identify_in_t *in,
                                    dq_q30_t e)
{
    dq_q30_t target = {0, 0};
    if (in->point->valid && in->enabled) {
        const q15_t w = fx_q15_from_q31(in->point->omega);
        const int32_t square = fx_mul_q30(w, w) + fx_mul_q30(config->local_corner, config->local_corner);
        const q16_t gain = in->point->omega / fx_max_s32(square >> 15, 1); /* Q31/Q15 */
        target = (dq_q30_t){fx_mul_gain_q31(gain, e.q), fx_mul_gain_q31(-gain, e.d)};
    }
    const int32_t twice = fx_add_q31(config->local_rate, config->local_rate);
    dq_q30_t *local = &state->kept.local;
    local->d = fx_mulhi_add(local->d, twice, fx_sub_q31(target.d, local->d));
    local->q = fx_mulhi_add(local->q, twice, fx_sub_q31(target.q, local->q));
}

/* The tables' flux and magnetising current, corrected by all parameters and by the local flux error (ID-15). */
static corrected_t correct(const identify_config_t *config, const identify_state_t *state, const identify_model_t *m)
{
    dq_q30_t shift = state->kept.local;
    int32_t value[IDENTIFY_STATES];
    for (unsigned j = IDENTIFY_FIRST_OF_FLUX; j < IDENTIFY_STATES; j++) {
        value[j] = identify_value(config, state, (identify_index_t)j) >> 1;
        shift.d = fx_add_q31(shift.d, identify_mul(value[j], m->psi_d.h_q30[j]));
        shift.q = fx_add_q31(shift.q, identify_mul(value[j], m->psi_q.h_q30[j]));
    }
    const int32_t iron = value[IDENTIFY_IRON];
    const int32_t d_axis = identify_mul(value[IDENTIFY_LD], m->psi_d.h_q30[IDENTIFY_LD]);
    return (corrected_t){
        .at.psi = {fx_add_q31(m->psi.d, fx_add_q31(shift.d, value[IDENTIFY_FLUX])), fx_add_q31(m->psi.q, shift.q)},
        .at.i_m = {m->i_m.d + identify_mul(iron, m->iron_i.d), m->i_m.q + identify_mul(iron, m->iron_i.q)},
        .magnet_q30 = fx_add_q31(value[IDENTIFY_FLUX], d_axis),
    };
}

identify_out_t identify_step(const identify_config_t *config, identify_state_t *state, const identify_in_t *in)
{
    identify_check_kept(state);
    if (state->steps == 0U) {
        update_q_axis(config, state);
    }
    resistance_prior(config, state, in);
    identify_model_t model;
    identify_model(config, in->point, in->tables, state->kept.r_prior, &model);
    model.now.e.d = fx_sub_q31(model.now.e.d, kalman_output(&state->kalman, &model.now.d));
    model.now.e.q = fx_sub_q31(model.now.e.q, kalman_output(&state->kalman, &model.now.q));
    update_local_flux_error(config, state, in, model.now.e);
    average_step(config, state, in, &model);
    const corrected_t now = correct(config, state, &model);
    const int32_t torque = identify_mean_torque(config, &in->tables->inductances, in->point->chord_q30, &now.at);
    const identify_out_t out = {fx_round_q15_word(torque), fx_round_q15_word(now.magnet_q30)};
    if (state->steps == PREDICTION_STEP) {
        identify_check_parameters(state);
        kalman_predict(config, &state->kalman, state->kept.r_known);
        identify_seal_parameters(state);
        update_confidence(config, state, &model, out.torque);
    } else if (state->steps >= IDENTIFY_STEPS) {
        update_d_axis(state);
    }
    identify_seal_kept(state);
    return out;
}
