/* SPDX-License-Identifier: Apache-2.0 */
#include "control/current/angle_tracker.h"

#include "fx/codegen.h"
#include "fx/q.h"

#define COAST_ROUNDS 10

/* Advance per period. It wraps beyond half a turn, as the angle does. */
static FX_NOT_INLINED FX_COLD int32_t advance_at(const angle_tracker_config_t *config, int32_t omega_q30)
{
    return (int32_t)((uint32_t)fx_mulhi(config->pu_to_turn, omega_q30) << config->turn_shift);
}

static angle_t result(uint32_t theta_e, int32_t step, int32_t omega_q30, bool jumped)
{
    return (angle_t){
        .theta_e = theta_e,
        .step = step,
        .omega_q31 = fx_add_q31(omega_q30, omega_q30),
        .jumped = jumped,
    };
}

/* The first two samples set angle and speed directly, so that the loop locks without a cycle slip if the machine
 * already turns: the first sample is the prediction for the second, and their difference is the advance per period. */
static void start(const angle_tracker_config_t *config, angle_tracker_state_t *state, uint32_t theta_e)
{
    const int32_t advance = (state->samples == 1U) ? (int32_t)(theta_e - state->predicted) : 0;
    state->omega_q30 = fx_mul_gain_q31(config->turn_to_pu, advance) >> 1;
    state->predicted = theta_e + (uint32_t)advance_at(config, state->omega_q30);
    state->samples++;
}

angle_t angle_tracker_follow(const angle_tracker_config_t *config, angle_tracker_state_t *state, uint32_t theta_m)
{
    const uint32_t theta_e = theta_m * config->pole_pairs + config->offset;
    const fx_two_words_t before = FX_LOAD_TWO(state, predicted, omega_q30);
    const uint32_t predicted = (uint32_t)before.first;
    const int32_t error = (int32_t)(theta_e - predicted);
    const fx_two_words_t gains = FX_LOAD_TWO(config, kp, ki_q29);
    /* Turns in Q32 * Q29 = Q29, counted twice. */
    const int32_t omega_q30 = fx_add2_q31(before.second, fx_mulhi(gains.second, error));
    const bool jumped = (uint32_t)error + config->max_step > 2U * config->max_step;
    const angle_t angle = result(theta_e, fx_mulhi(config->pu_to_turn, omega_q30), omega_q30, jumped);
    /* Q31 gain * turns = half the correction; the doubling costs one LSB of 2^-32 turn. */
    state->predicted = predicted + (uint32_t)angle.step + 2U * (uint32_t)fx_mulhi(gains.first, error);
    state->omega_q30 = omega_q30;
    return angle;
}

FX_COLD angle_t angle_tracker_step(const angle_tracker_config_t *config, angle_tracker_state_t *state, uint32_t theta_m)
{
    angle_t angle;
    if (state->samples >= 2U) {
        angle = angle_tracker_follow(config, state, theta_m);
        const uint32_t step = (uint32_t)angle.step << config->turn_shift;
        state->predicted += step - (uint32_t)angle.step;
        angle.step = (int32_t)step;
    } else {
        const uint32_t theta_e = theta_m * config->pole_pairs + config->offset;
        start(config, state, theta_e);
        angle = result(theta_e, advance_at(config, state->omega_q30), state->omega_q30, false);
    }
    return angle;
}

/* State of the loop before a sample: the sample's deviation from its prediction, the speed, the advance per period. */
typedef struct {
    int32_t error, omega_q30, step;
} before_sample_t;

/* Recovers the state before a sample from the state after it. The new prediction is theta~ + step + k_p e, where theta~
 * is the old one and e = theta_e - theta~. Hence e = difference + k_p e; an iteration leaves k_p < 1/8 of the error. */
static FX_NOT_INLINED FX_COLD before_sample_t state_before_sample(const angle_tracker_config_t *config,
                                                                  const angle_tracker_state_t *state, uint32_t theta_e)
{
    const uint32_t step = (uint32_t)advance_at(config, state->omega_q30);
    const int32_t difference = (int32_t)(theta_e + step - state->predicted);
    int32_t error = difference;
    for (int n = 0; n < COAST_ROUNDS; n++) {
        error = (int32_t)((uint32_t)difference + 2U * (uint32_t)fx_mulhi(config->kp, error));
    }
    const int32_t omega_q30 = fx_add2_q31(state->omega_q30, -fx_mulhi(config->ki_q29, error));
    return (before_sample_t){error, omega_q30, advance_at(config, omega_q30)};
}

/* Undoes the loop's step for this sample. */
FX_COLD angle_t angle_tracker_coast(const angle_tracker_config_t *config, angle_tracker_state_t *state,
                                    uint32_t theta_e)
{
    const before_sample_t at = state_before_sample(config, state, theta_e);
    const angle_t angle = result(theta_e - (uint32_t)at.error, at.step, at.omega_q30, true);
    state->omega_q30 = at.omega_q30;
    state->predicted = angle.theta_e + (uint32_t)angle.step;
    return angle;
}

/* Whether the sensor has failed or the rotor stands. A reading that repeats for longer than the sensor's resolution
 * explains (AT-16) is a sensor failure, unless the rotor lagged behind the prediction before: then it stops (AT-17). */
static repeat_cause_t cause_of_repeats(const angle_tracker_config_t *config, const angle_tracker_state_t *state,
                                       const angle_t *angle)
{
    const int32_t repeats = (int32_t)state->repeats;
    if (!angle->jumped && (int64_t)fx_abs_q31(angle->step) * repeats <= config->repeat_max) {
        return REPEATS_UNDECIDED; /* at rest: the rest of this function gives the same, in 100 more instructions */
    }
    const before_sample_t at = state_before_sample(config, state, angle->theta_e);
    const int32_t step = fx_abs_q31(at.step);
    const int64_t advance = (int64_t)step * repeats;
    const int64_t behind = (at.step < 0) ? (int64_t)at.error : -(int64_t)at.error;
    if (advance <= config->repeat_max) {
        return REPEATS_UNDECIDED;
    }
    return (behind - advance <= (int64_t)step * (int32_t)config->lag_steps) ? REPEATS_OF_SENSOR : REPEATS_OF_ROTOR;
}

FX_COLD angle_repeat_t angle_tracker_repeated(const angle_tracker_config_t *config, angle_tracker_state_t *state,
                                              angle_t *angle, uint32_t period)
{
    const bool in_a_row = period - state->repeat_period == 1U;
    state->repeats = in_a_row ? state->repeats + (state->repeats < UINT16_MAX ? 1U : 0U) : 1U;
    state->repeat_period = period;
    state->cause = in_a_row ? state->cause : REPEATS_UNDECIDED;
    if (state->cause == REPEATS_UNDECIDED) {
        state->cause = cause_of_repeats(config, state, angle);
    }
    if (state->cause != REPEATS_OF_SENSOR) {
        return ANGLE_FOLLOWED;
    }
    if (state->repeats <= config->stop_periods || !angle_tracker_may_stop(config, state)) {
        return ANGLE_STUCK;
    }
    state->cause = REPEATS_OF_ROTOR; /* (AT-18) */
    state->omega_q30 = 0;
    state->predicted = angle->theta_e;
    *angle = result(angle->theta_e, 0, 0, false);
    return ANGLE_STANDING;
}

FX_COLD bool angle_tracker_may_stick(const angle_tracker_config_t *config, const angle_tracker_state_t *state)
{
    const int64_t step = fx_abs_q31(advance_at(config, state->omega_q30));
    return step * config->stop_periods > config->repeat_max;
}

FX_NOT_INLINED FX_COLD bool angle_tracker_may_stop(const angle_tracker_config_t *config,
                                                   const angle_tracker_state_t *state)
{
    return fx_abs_q31(state->omega_q30) <= config->stop_speed_q30;
}
