/* SPDX-License-Identifier: Apache-2.0 */
#include "control/current/angle_tracker.h"

#include "fx/q.h"

#define COAST_ROUNDS 10

static angle_t result(const angle_tracker_config_t *config, uint32_t theta_e, int32_t omega_q30, bool jumped)
{
    return (angle_t){
        .theta_e = theta_e,
        .step = fx_mulhi(config->pu_to_turn, omega_q30),
        .omega_q31 = fx_add_q31(omega_q30, omega_q30),
        .jumped = jumped,
    };
}

/* The first two samples set angle and speed directly, so that the loop locks without a cycle slip if the machine
 * already turns: the first sample is the prediction for the second one, and the difference is the advance per period.
 * */
static void start(const angle_tracker_config_t *config, angle_tracker_state_t *state, uint32_t theta_e)
{
    const int32_t advance = (state->samples == 1) ? (int32_t)(theta_e - state->predicted) : 0;
    state->omega_q30 = fx_mul_gain_q31(config->turn_to_pu, advance) >> 1;
    state->predicted = theta_e + (uint32_t)fx_mulhi(config->pu_to_turn, state->omega_q30);
    state->samples++;
}

__attribute__((cold)) angle_t angle_tracker_step(const angle_tracker_config_t *config, angle_tracker_state_t *state,
                                                 uint32_t theta_m)
{
    if (state->samples >= 2) {
        return angle_tracker_follow(config, state, theta_m);
    }
    const uint32_t theta_e = theta_m * config->pole_pairs + config->offset;
    start(config, state, theta_e);
    return result(config, theta_e, state->omega_q30, false);
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
    const angle_t angle = result(config, theta_e, omega_q30, jumped);
    /* Q31 gain * turns = half the correction; the doubling costs one LSB of 2^-32 turn. */
    state->predicted = predicted + (uint32_t)angle.step + 2U * (uint32_t)fx_mulhi(gains.first, error);
    state->omega_q30 = omega_q30;
    return angle;
}

/* The step of the loop is undone. The new prediction is the old one + step + k_p e with e = theta_e - the old one, so
 * e = difference + k_p e; each round leaves the share k_p < 1/8 of its error. */
__attribute__((cold)) angle_t angle_tracker_coast(const angle_tracker_config_t *config, angle_tracker_state_t *state,
                                                  uint32_t theta_e)
{
    const uint32_t step = (uint32_t)fx_mulhi(config->pu_to_turn, state->omega_q30);
    const int32_t difference = (int32_t)(theta_e + step - state->predicted);
    int32_t error = difference;
    for (int n = 0; n < COAST_ROUNDS; n++) {
        error = (int32_t)((uint32_t)difference + 2U * (uint32_t)fx_mulhi(config->kp, error));
    }
    const int32_t correction = fx_mulhi(config->ki_q29, error);
    state->omega_q30 = fx_sat_q31((int64_t)state->omega_q30 - 2 * (int64_t)correction);
    const angle_t angle = result(config, theta_e - (uint32_t)error, state->omega_q30, true);
    state->predicted = angle.theta_e + (uint32_t)angle.step;
    return angle;
}
