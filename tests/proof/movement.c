/* SPDX-License-Identifier: Apache-2.0 */
/* A movement of the shaft for commissioning: whatever is asked for, and whatever the state has been before. */
#include "proof.h"

#include "fx/div.c"
#include "fx/format.c"
#include "fx/q.c"

#include "drive/movement.c"

/* The machine's bounds, as `motor build` makes them. */
static movement_config_t any_config(void)
{
    movement_config_t config;
    ASSUME(config.i_max > 0 && config.i_slew > 0 && config.i_slew < Q15_MAX &&
           WITHIN(config.omega_max, 1, INT32_MAX - 1));
    ASSUME(WITHIN(config.rate_max, 1, 1 << 24) && WITHIN(config.rate_slew, 1, 1 << 24));
    ASSUME(config.steps_max < UINT32_MAX && config.blocked_steps > 0U && config.blocked_steps < UINT16_MAX);
    return config;
}

static movement_request_t any_request(void)
{
    movement_request_t request;
    request.reversed = nondet_bool();
    request.damped = nondet_bool();
    request.alive = nondet_bool();
    request.may_begin = nondet_bool();
    return request;
}

static movement_in_t any_inputs(void)
{
    movement_in_t in;
    in.runs = nondet_bool();
    in.has_failed = nondet_bool();
    in.has_request = nondet_bool();
    return in;
}

/* Currents within their bounds, as the step before has left them. */
static movement_state_t any_state(const movement_config_t *config)
{
    movement_state_t state;
    state.weak = nondet_bool();
    ASSUME(state.phase == MOVEMENT_PHASE_IDLE || state.phase == MOVEMENT_PHASE_AGREED ||
           state.phase == MOVEMENT_PHASE_ENDED);
    ASSUME(WITHIN(state.i_ref.d, -config->i_max, config->i_max));
    ASSUME(WITHIN(state.i_ref.q, -config->i_max, config->i_max));
    ASSUME(state.blocked < config->blocked_steps && state.steps <= config->steps_max);
    return state;
}

void proof_movement_bounds(void)
{
    const movement_config_t config = any_config();
    const movement_request_t request = any_request();
    const movement_in_t in = any_inputs();
    movement_state_t state = any_state(&config);
    const movement_state_t before = state;
    movement_frame_t frame;
    ASSUME(WITHIN(frame.rate, -config.rate_max, config.rate_max) && movement_is_agreed(&state));
    movement_step(&config, 4U, &state, &frame, &request, &in);
    PROVE(WITHIN(state.i_ref.d, -config.i_max, config.i_max) && WITHIN(state.i_ref.q, -config.i_max, config.i_max));
    PROVE(WITHIN(frame.rate, -config.rate_max, config.rate_max));
    PROVE(state.steps <= config.steps_max);
    PROVE(!movement_is_agreed(&state) || !in.runs || magnitude(state.i_ref.q - before.i_ref.q) <= config.i_slew);
}

void proof_movement_ends(void)
{
    const movement_config_t config = any_config();
    const movement_request_t request = any_request();
    const movement_in_t in = any_inputs();
    movement_state_t state = any_state(&config);
    const movement_state_t before = state;
    movement_frame_t frame;
    ASSUME(WITHIN(frame.rate, -config.rate_max, config.rate_max));
    movement_step(&config, 4U, &state, &frame, &request, &in);
    const bool continues = movement_is_agreed(&state) && movement_is_agreed(&before);
    const bool begins = movement_is_agreed(&state) && !movement_is_agreed(&before);
    PROVE(!continues || (request.alive && !in.has_failed && !in.has_request && request.movement == before.movement));
    PROVE(!continues || !in.runs || magnitude(in.omega) <= config.omega_max);
    PROVE(!begins || (before.phase == MOVEMENT_PHASE_IDLE && request.alive && request.may_begin && !in.runs &&
                      !in.has_failed && request.movement != (uint8_t)MOVEMENT_NONE));
}
