/* SPDX-License-Identifier: Apache-2.0 */
#include "control/commission/commission.h"

#include "control/current/transform.h"
#include "fx/codegen.h"
#include "fx/trig.h"

#define CURRENT_TOLERANCE 256 /* q15, besides an eighth of the level */

/* 2^(-6 + k/2) of the largest current. */
static const q15_t level[COMMISSION_LEVELS] = {512, 724, 1024, 1448, 2048, 2896, 4096, 5793, 8192, 11585};

static void stop(commission_state_t *state, commission_phase_t phase, commission_failure_t why)
{
    state->phase = phase;
    state->failure = why;
    state->i_ref = (dq_q15_t){0, 0};
}

static void next_current(const commission_config_t *config, commission_state_t *state)
{
    const int32_t i = fx_mul_q15(config->i_max, level[state->index / 2U]);
    state->i_ref = (dq_q15_t){(state->index % 2U == 0U) ? i : -i, 0};
    state->phase = COMMISSION_SETTLE;
    state->steps = 0;
    state->sum_i = 0;
    state->sum_u = 0;
}

void commission_start(const commission_config_t *config, commission_state_t *state)
{
    *state = (commission_state_t){.index = 0};
    next_current(config, state);
}

/* Magnitudes of the phases' cosines at this rotor angle, the largest first. */
static void store_cosines(commission_data_t *data, uint32_t theta)
{
    const fx_pair_t cos_sin = fx_unit_vector(theta);
    const int32_t alpha = (int16_t)(cos_sin & 0xFFFFU) * Q15_MAX >> 15;
    const int32_t beta_q30 = ((int32_t)cos_sin >> 16) * Q15_MAX;
    const abc_t phases = inverse_clarke(alpha, fx_mulhi(beta_q30, Q31(SQRT3_HALF)) >> 14);
    int32_t c[3] = {fx_abs_q31(phases.a), fx_abs_q31(phases.b), fx_abs_q31(phases.c)};
    for (unsigned k = 2; k-- > 0U;) {
        const int32_t larger = fx_max_s32(c[k], c[k + 1U]);
        c[k + 1U] = fx_min_s32(c[k], c[k + 1U]);
        c[k] = larger;
    }
    for (unsigned phase = 0; phase < 3U; phase++) {
        data->cosine[phase] = fx_sat_q15(c[phase]);
    }
}

static commission_failure_t check_step(const commission_config_t *config, const commission_state_t *state,
                                       const commission_in_t *in)
{
    const int32_t periods = config->periods_per_step; /* all quantities below are sums over a step */
    const int32_t error_d = fx_abs_q31(in->sum_i.d - periods * state->i_ref.d);
    const int32_t error_q = fx_abs_q31(in->sum_i.q);
    const int32_t allowed = periods * ((fx_abs_q31(state->i_ref.d) >> 3) + CURRENT_TOLERANCE);
    if (!in->acting) {
        return COMMISSION_STOPPED;
    }
    if (fx_abs_q31(in->omega) > config->omega_max) {
        return COMMISSION_MOVED;
    }
    if (state->phase != COMMISSION_MEASURE) {
        return COMMISSION_GOOD; /* the current step may need all of the voltage for a moment */
    }
    if (in->limited) {
        return COMMISSION_LIMITED;
    }
    return (error_d > allowed || error_q > allowed) ? COMMISSION_CURRENT : COMMISSION_GOOD;
}

static FX_NOT_INLINED int32_t half_mean_q30(const commission_config_t *config, int32_t sum)
{
    return fx_sat_q31(((int64_t)sum * config->mean_gain_q31) >> 16) >> 1;
}

/* Half of the difference of both polarities: offsets of the sensors cancel (CM-1). */
static void store_level(const commission_config_t *config, commission_state_t *state)
{
    const unsigned k = state->index / 2U;
    const bool opposite = state->index % 2U != 0U;
    const int32_t i = half_mean_q30(config, state->sum_i);
    const int32_t u = half_mean_q30(config, state->sum_u);
    state->data.i[k] = opposite ? fx_sub_q31(state->data.i[k], i) : i;
    state->data.u[k] = opposite ? fx_sub_q31(state->data.u[k], u) : u;
}

static void measure(const commission_config_t *config, commission_state_t *state, const commission_in_t *in)
{
    state->sum_i += in->sum_i.d;
    state->sum_u += in->sum_u.d;
    if (state->steps < config->measure_steps) {
        return;
    }
    store_level(config, state);
    state->index++;
    if (state->index >= 2U * COMMISSION_LEVELS) {
        store_cosines(&state->data, in->theta);
        stop(state, COMMISSION_DONE, COMMISSION_GOOD);
    } else {
        next_current(config, state);
    }
}

void commission_step(const commission_config_t *config, commission_state_t *state, const commission_in_t *in)
{
    if (!commission_runs(state)) {
        return;
    }
    const commission_failure_t failure = check_step(config, state, in);
    state->steps++;
    if (failure != COMMISSION_GOOD) {
        stop(state, COMMISSION_FAILED, failure);
    } else if (state->phase == COMMISSION_MEASURE) {
        measure(config, state, in);
    } else if (state->steps >= config->settle_steps) {
        state->phase = COMMISSION_MEASURE;
        state->steps = 0;
    }
}
