/* SPDX-License-Identifier: Apache-2.0 */
#include "control/angle_tracker.h"

#include "fx/q.h"

/* The first two samples set angle and speed directly, so that start-up at speed slips no cycle. */
static __attribute__((noinline, cold)) void start(angle_tracker_state_t *state, uint32_t theta_e)
{
    state->step = (state->samples == 1) ? (int32_t)(theta_e - state->theta) : 0;
    state->theta = theta_e;
    state->samples++;
}

angle_t angle_tracker_step(const angle_tracker_config_t *config, angle_tracker_state_t *state, uint32_t theta_m)
{
    const uint32_t theta_e = theta_m * config->pole_pairs + config->offset;
    bool jumped = false;

    if (state->samples < 2) {
        start(state, theta_e);
    } else {
        const uint32_t predicted = state->theta + (uint32_t)state->step;
        const int32_t error = (int32_t)(theta_e - predicted);
        jumped = (uint32_t)fx_abs_q31(error) > config->max_step;
        /* Q31 gain * turns = half the correction; the doubling costs one LSB of 2^-32 turn. */
        state->step = fx_add2_q31(state->step, fx_mulhi(config->ki, error));
        state->theta = predicted + 2U * (uint32_t)fx_mulhi(config->kp, error);
    }
    return (angle_t){
        .theta_e = theta_e,
        .step = state->step,
        .omega_q31 = fx_mul_gain_q31(config->turn_to_pu, state->step),
        .jumped = jumped,
    };
}
