/* SPDX-License-Identifier: Apache-2.0 */
#include "drive/movement.h"

#include "fx/div.h"
#include "signal/rate_limit.h"

#define RATIO_MAX 64                /* above MOVEMENT_PAIRS_MAX; 2^31/RATIO_MAX = 2^25 */
#define SWING_STEPS 10U             /* over which the damping compares the rotor's speed */
#define WEAK_SHARE Q15(0.2)         /* of the current, while the rotor becomes faster */

movement_frame_motion_t movement_frame_step(const movement_frame_t *frame, movement_angle_t *angle,
                                            const movement_sensor_t *sensor)
{
    angle->omega_sensor = sensor->omega;
    if (frame->pole_pairs == 0) {
        angle->imposed += (uint32_t)frame->rate;
        return (movement_frame_motion_t){angle->imposed, frame->rate, 0}; /* the back-EMF of 1 Hz is negligible */
    }
    return (movement_frame_motion_t){
        .theta_e = (uint32_t)frame->pole_pairs * sensor->theta_m + frame->offset,
        .step = (int32_t)(((int64_t)sensor->step * frame->ratio_q25) >> 25),
        .omega = fx_sat_q31(((int64_t)sensor->omega * frame->ratio_q25) >> 25),
    };
}

static void end(movement_state_t *state, movement_failure_t failure)
{
    *state = (movement_state_t){.phase = MOVEMENT_PHASE_ENDED, .failure = failure};
}

static bool is_in_range(const movement_request_t *request)
{
    return request->pole_pairs >= 1U && request->pole_pairs <= MOVEMENT_PAIRS_MAX;
}

static void begin(uint32_t pole_pairs, movement_state_t *state, movement_frame_t *frame,
                  const movement_request_t *request, const movement_in_t *in)
{
    if (in->runs || in->has_failed || !request->may_begin || !is_in_range(request)) {
        end(state, MOVEMENT_FAILURE_REFUSED);
        return;
    }
    const bool imposed = request->movement == (uint8_t)MOVEMENT_IMPOSED;
    const int32_t pairs = imposed ? 0 : request->reversed ? -(int32_t)request->pole_pairs : request->pole_pairs;
    const int32_t ratio = fx_div_q31(request->pole_pairs, (int32_t)pole_pairs * RATIO_MAX);
    *frame = (movement_frame_t){pairs, (pairs < 0) ? -ratio : ratio, (uint32_t)request->offset << 16, 0};
    *state = (movement_state_t){.phase = MOVEMENT_PHASE_AGREED, .movement = request->movement};
}

static bool is_blocked(const movement_config_t *config, movement_state_t *state, q31_t omega)
{
    const bool stands = state->movement == (uint8_t)MOVEMENT_SPIN && fx_abs_q31(omega) < config->omega_still &&
                        fx_abs_q31(state->i_ref.q) >= config->i_blocked;
    state->blocked = stands ? (uint16_t)(state->blocked + 1U) : 0U;
    return state->blocked >= config->blocked_steps;
}

/* Whether speed or position of the sensor end a movement that acts. */
static movement_failure_t failure_by_sensor(const movement_config_t *config, movement_state_t *state,
                                            const movement_in_t *in)
{
    if (fx_abs_q31(in->omega) > config->omega_max) {
        return MOVEMENT_FAILURE_FAST;
    }
    if (is_blocked(config, state, in->omega)) {
        return MOVEMENT_FAILURE_BLOCKED;
    }
    state->steps += movement_moves(state) ? 1U : 0U;
    return (state->steps > config->steps_max) ? MOVEMENT_FAILURE_LONG : MOVEMENT_FAILURE_GOOD;
}

/* The reason for which the movement must end now, if there is one. */
static movement_failure_t failure_of(const movement_config_t *config, movement_state_t *state,
                                     const movement_request_t *request, const movement_in_t *in)
{
    if (!request->alive) {
        return MOVEMENT_FAILURE_SILENT;
    }
    if (in->has_failed || in->has_request) {
        return MOVEMENT_FAILURE_STOPPED;
    }
    if (request->movement != state->movement) {
        return MOVEMENT_FAILURE_REFUSED;
    }
    return in->runs ? failure_by_sensor(config, state, in) : MOVEMENT_FAILURE_GOOD;
}

/* The torque of a current along the imposed d axis accelerates the rotor towards it and brakes it beyond. */
static void compare_swing(movement_state_t *state, uint32_t theta_m)
{
    if (state->swing_steps != 0U) {
        state->swing_steps--;
        return;
    }
    const uint32_t moved = (uint32_t)fx_abs_q31((int32_t)(theta_m - state->theta_m));
    state->weak = moved > state->moved;
    state->moved = moved;
    state->theta_m = theta_m;
    state->swing_steps = SWING_STEPS - 1U;
}

static q15_t bounded(const movement_config_t *config, int32_t i)
{
    return fx_clamp_q15(fx_sat_q15(i), fx_neg_q15(config->i_max), config->i_max);
}

static dq_q15_t wanted_currents(const movement_config_t *config, const movement_state_t *state,
                                const movement_request_t *request)
{
    const dq_q15_t i = {bounded(config, request->i.d), bounded(config, request->i.q)};
    const bool weak = request->damped && state->weak;
    return weak ? (dq_q15_t){fx_mul_q15(WEAK_SHARE, (q15_t)i.d), fx_mul_q15(WEAK_SHARE, (q15_t)i.q)} : i;
}

static int32_t wanted_rate(const movement_config_t *config, const movement_request_t *request)
{
    const bool forward = request->direction == (uint8_t)MOVEMENT_FORWARD;
    const bool backward = request->direction == (uint8_t)MOVEMENT_BACKWARD;
    return forward ? config->rate_max : backward ? -config->rate_max : 0;
}

static void follow(const movement_config_t *config, movement_state_t *state, movement_frame_t *frame,
                   const movement_request_t *request, const movement_in_t *in)
{
    if (!in->runs) {
        state->i_ref = (dq_q15_t){0, 0};
        frame->rate = 0;
        return;
    }
    compare_swing(state, in->theta_m);
    const dq_q15_t wanted = wanted_currents(config, state, request);
    state->i_ref.d = rate_limit_step((q15_t)state->i_ref.d, (q15_t)wanted.d, config->i_slew);
    state->i_ref.q = rate_limit_step((q15_t)state->i_ref.q, (q15_t)wanted.q, config->i_slew);
    const int32_t change = wanted_rate(config, request) - frame->rate;
    frame->rate += fx_clamp_q31(change, -config->rate_slew, config->rate_slew);
}

void movement_step(const movement_config_t *config, uint32_t pole_pairs, movement_state_t *state,
                   movement_frame_t *frame, const movement_request_t *request, const movement_in_t *in)
{
    const bool asked = request->alive && request->movement != (uint8_t)MOVEMENT_NONE;
    if (request->alive && !asked && !in->runs) {
        *state = (movement_state_t){.phase = MOVEMENT_PHASE_IDLE, .failure = state->failure};
    }
    if (asked && state->phase == MOVEMENT_PHASE_IDLE) {
        begin(pole_pairs, state, frame, request, in);
    }
    if (!movement_is_agreed(state)) {
        return;
    }
    const movement_failure_t failure = failure_of(config, state, request, in);
    if (failure != MOVEMENT_FAILURE_GOOD) {
        end(state, failure);
        return;
    }
    follow(config, state, frame, request, in);
}
