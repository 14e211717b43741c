/* SPDX-License-Identifier: Apache-2.0 */
/* A movement of the shaft: its frame, its bounds, and what ends it. */
#include "drive/movement.h"

#include "unity.h"

#define PAIRS 4U

/* Round numbers: 1000 of current, reached in 10 steps; a rate of 400, reached in 4 steps. */
static const movement_config_t config = {
    .i_max = 1000,
    .i_slew = 100,
    .i_blocked = 300,
    .omega_max = 1000000,
    .omega_still = 1000,
    .rate_max = 400,
    .rate_slew = 100,
    .blocked_steps = 5,
    .steps_max = 50,
};
static movement_state_t state;
static movement_frame_t frame;
static movement_request_t request;
static movement_in_t in;

void setUp(void)
{
    state = (movement_state_t){.phase = MOVEMENT_PHASE_IDLE};
    frame = (movement_frame_t){0};
    in = (movement_in_t){0};
    request = (movement_request_t){.movement = MOVEMENT_SPIN, .pole_pairs = 3, .alive = true, .may_begin = true};
}

void tearDown(void)
{
}

static void steps(int count)
{
    for (int n = 0; n < count; n++) {
        movement_step(&config, PAIRS, &state, &frame, &request, &in);
    }
}

static void begun(uint8_t movement)
{
    setUp();
    request.movement = movement;
    steps(1);
    TEST_ASSERT_EQUAL_INT(MOVEMENT_PHASE_AGREED, state.phase);
    in.runs = true;
}

static void ended_by(movement_failure_t failure)
{
    TEST_ASSERT_EQUAL_INT(MOVEMENT_PHASE_ENDED, state.phase);
    TEST_ASSERT_EQUAL_INT(failure, state.failure);
    TEST_ASSERT_FALSE(movement_is_agreed(&state));
    TEST_ASSERT_EQUAL_INT32(0, state.i_ref.d);
    TEST_ASSERT_EQUAL_INT32(0, state.i_ref.q);
}

/* 3 electrical turns for each of the sensor where the motor data have 4: 0x10000000 * 3 + 0x01230000. */
void test_the_frame_of_a_connection_is_that_of_the_sensor(void)
{
    movement_angle_t angle = {0};
    request.offset = 0x0123;
    steps(1);
    const movement_sensor_t sensor = {.theta_m = 0x10000000U, .step = 4000, .omega = 400000};
    movement_frame_motion_t motion = movement_frame_step(&frame, &angle, &sensor);
    TEST_ASSERT_EQUAL_HEX32(0x31230000U, motion.theta_e);
    TEST_ASSERT_INT32_WITHIN(1, 3000, motion.step);
    TEST_ASSERT_INT32_WITHIN(1, 300000, motion.omega);
    TEST_ASSERT_EQUAL_INT32(400000, angle.omega_sensor);
    setUp();
    request.reversed = true;
    steps(1);
    motion = movement_frame_step(&frame, &angle, &sensor);
    TEST_ASSERT_EQUAL_HEX32(0xD0000000U, motion.theta_e);
    TEST_ASSERT_INT32_WITHIN(1, -3000, motion.step);
    TEST_ASSERT_INT32_WITHIN(1, -300000, motion.omega);
}

void test_a_speed_beyond_the_format_saturates(void)
{
    movement_angle_t angle = {0};
    request.pole_pairs = 8;
    steps(1);
    movement_sensor_t sensor = {.omega = 0x60000000};
    TEST_ASSERT_EQUAL_INT32(INT32_MAX, movement_frame_step(&frame, &angle, &sensor).omega);
    sensor.omega = -0x60000000;
    TEST_ASSERT_EQUAL_INT32(INT32_MIN, movement_frame_step(&frame, &angle, &sensor).omega);
}

void test_the_imposed_angle_turns_with_a_slope_in_both_directions(void)
{
    movement_angle_t angle = {0};
    const movement_sensor_t sensor = {.theta_m = 0x10000000U, .step = 4000, .omega = 77};
    begun(MOVEMENT_IMPOSED);
    request.direction = MOVEMENT_FORWARD;
    steps(1);
    TEST_ASSERT_EQUAL_INT32(100, frame.rate);
    steps(9);
    TEST_ASSERT_EQUAL_INT32(400, frame.rate);
    const movement_frame_motion_t motion = movement_frame_step(&frame, &angle, &sensor);
    TEST_ASSERT_EQUAL_HEX32(400, motion.theta_e);
    TEST_ASSERT_EQUAL_INT32(400, motion.step);
    TEST_ASSERT_EQUAL_INT32(0, motion.omega);
    TEST_ASSERT_EQUAL_INT32(77, angle.omega_sensor);
    TEST_ASSERT_EQUAL_HEX32(800, movement_frame_step(&frame, &angle, &sensor).theta_e);
    request.direction = MOVEMENT_BACKWARD;
    steps(6);
    TEST_ASSERT_EQUAL_INT32(-200, frame.rate);
    request.direction = MOVEMENT_STAND;
    steps(2);
    TEST_ASSERT_EQUAL_INT32(0, frame.rate);
    steps(1);
    TEST_ASSERT_EQUAL_INT32(0, frame.rate);
}

void test_with_switching_disabled_the_imposed_angle_stands(void)
{
    begun(MOVEMENT_IMPOSED);
    request.direction = MOVEMENT_FORWARD;
    steps(4);
    TEST_ASSERT_EQUAL_INT32(400, frame.rate);
    in.runs = false;
    steps(1);
    TEST_ASSERT_EQUAL_INT32(0, frame.rate);
}

void test_the_currents_are_cut_and_follow_with_a_slope(void)
{
    begun(MOVEMENT_SPIN);
    request.i = (dq_q15_t){5000, -5000};
    in.omega = config.omega_still;
    steps(1);
    TEST_ASSERT_EQUAL_INT32(100, state.i_ref.d);
    TEST_ASSERT_EQUAL_INT32(-100, state.i_ref.q);
    steps(20);
    TEST_ASSERT_EQUAL_INT32(1000, state.i_ref.d);
    TEST_ASSERT_EQUAL_INT32(-1000, state.i_ref.q);
    in.runs = false;
    steps(1);
    TEST_ASSERT_EQUAL_INT32(0, state.i_ref.d);
    TEST_ASSERT_EQUAL_INT32(0, state.i_ref.q);
}

/* Compared over 10 steps; a fifth of 900 is 180. */
void test_a_damped_current_is_weak_while_the_rotor_becomes_faster(void)
{
    begun(MOVEMENT_IMPOSED);
    request.i.d = 900;
    request.damped = true;
    steps(10);
    TEST_ASSERT_EQUAL_INT32(900, state.i_ref.d);
    in.theta_m = 1000;
    steps(10);
    TEST_ASSERT_EQUAL_INT32(180, state.i_ref.d);
    in.theta_m = 0; /* as fast as before, in the other direction */
    steps(10);
    TEST_ASSERT_EQUAL_INT32(900, state.i_ref.d);
    in.theta_m = (uint32_t)-1001;
    steps(10);
    TEST_ASSERT_EQUAL_INT32(180, state.i_ref.d);
    request.damped = false;
    steps(10);
    TEST_ASSERT_EQUAL_INT32(900, state.i_ref.d);
}

void test_a_current_without_damping_stays_while_the_rotor_becomes_faster(void)
{
    begun(MOVEMENT_IMPOSED);
    request.i.d = 900;
    steps(10);
    in.theta_m = 1000;
    steps(10);
    TEST_ASSERT_EQUAL_INT32(900, state.i_ref.d);
}

void test_both_currents_are_weakened(void)
{
    begun(MOVEMENT_IMPOSED);
    request.i = (dq_q15_t){900, -450};
    request.damped = true;
    steps(10);
    in.theta_m = 1000;
    steps(10);
    TEST_ASSERT_EQUAL_INT32(180, state.i_ref.d);
    TEST_ASSERT_EQUAL_INT32(-90, state.i_ref.q);
}

void test_at_constant_speed_a_damped_current_is_not_weakened(void)
{
    begun(MOVEMENT_IMPOSED);
    request.i.d = 900;
    request.damped = true;
    for (int interval = 0; interval < 4; interval++) {
        in.theta_m += 1000;
        steps(10);
    }
    TEST_ASSERT_FALSE(state.weak);
    TEST_ASSERT_EQUAL_INT32(900, state.i_ref.d);
}

static void refused(void)
{
    steps(1);
    ended_by(MOVEMENT_FAILURE_REFUSED);
    setUp();
}

void test_a_movement_begins_only_with_switching_disabled_and_in_the_right_state(void)
{
    in.runs = true;
    refused();
    in.has_failed = true;
    refused();
    request.may_begin = false;
    refused();
    request.pole_pairs = 0;
    refused();
    request.pole_pairs = MOVEMENT_PAIRS_MAX + 1U;
    refused();
    request.pole_pairs = MOVEMENT_PAIRS_MAX;
    steps(1);
    TEST_ASSERT_EQUAL_INT(MOVEMENT_PHASE_AGREED, state.phase);
    setUp();
    request.pole_pairs = 1;
    steps(1);
    TEST_ASSERT_EQUAL_INT(MOVEMENT_PHASE_AGREED, state.phase);
}

void test_after_an_early_end_a_new_consent_is_needed(void)
{
    begun(MOVEMENT_SPIN);
    request.alive = false;
    steps(1);
    ended_by(MOVEMENT_FAILURE_SILENT);
    request.alive = true;
    in.runs = false;
    steps(3);
    ended_by(MOVEMENT_FAILURE_SILENT);
    request.movement = MOVEMENT_NONE;
    in.runs = true; /* not yet disabled */
    steps(1);
    ended_by(MOVEMENT_FAILURE_SILENT);
    in.runs = false;
    steps(1);
    TEST_ASSERT_EQUAL_INT(MOVEMENT_PHASE_IDLE, state.phase);
    TEST_ASSERT_EQUAL_INT(MOVEMENT_FAILURE_SILENT, state.failure); /* can still be read */
    request.movement = MOVEMENT_SPIN;
    steps(1);
    TEST_ASSERT_EQUAL_INT(MOVEMENT_PHASE_AGREED, state.phase);
    TEST_ASSERT_EQUAL_INT(MOVEMENT_FAILURE_GOOD, state.failure);
}

void test_silence_before_the_first_message_means_nothing(void)
{
    request = (movement_request_t){0};
    steps(3);
    TEST_ASSERT_EQUAL_INT(MOVEMENT_PHASE_IDLE, state.phase);
    setUp();
    request.alive = false;
    steps(3);
    TEST_ASSERT_EQUAL_INT(MOVEMENT_PHASE_IDLE, state.phase);
}

void test_silence_ends_a_movement_also_before_switching_is_enabled(void)
{
    begun(MOVEMENT_CONNECTED);
    in.runs = false;
    request.alive = false;
    steps(1);
    ended_by(MOVEMENT_FAILURE_SILENT);
}

void test_another_movement_or_none_ends_one_that_runs(void)
{
    begun(MOVEMENT_SPIN);
    request.movement = MOVEMENT_IMPOSED;
    steps(1);
    ended_by(MOVEMENT_FAILURE_REFUSED);
    begun(MOVEMENT_SPIN);
    request.movement = MOVEMENT_NONE;
    steps(1);
    ended_by(MOVEMENT_FAILURE_REFUSED);
}

void test_a_torque_request_at_the_beginning_ends_the_movement_at_once(void)
{
    in.has_request = true;
    steps(1);
    ended_by(MOVEMENT_FAILURE_STOPPED);
}

void test_a_torque_request_and_a_fault_end_a_movement(void)
{
    begun(MOVEMENT_SPIN);
    TEST_ASSERT_TRUE(movement_moves(&state));
    in.has_request = true;
    steps(1);
    ended_by(MOVEMENT_FAILURE_STOPPED);
    begun(MOVEMENT_CONNECTED);
    TEST_ASSERT_FALSE(movement_moves(&state));
    steps(100); /* longer than a movement may take */
    TEST_ASSERT_EQUAL_INT(MOVEMENT_PHASE_AGREED, state.phase);
    in.has_failed = true;
    steps(1);
    ended_by(MOVEMENT_FAILURE_STOPPED);
}

void test_the_speed_of_the_sensor_is_limited_in_both_directions(void)
{
    for (int sign = -1; sign <= 1; sign += 2) {
        begun(MOVEMENT_IMPOSED);
        in.omega = sign * config.omega_max;
        steps(2);
        TEST_ASSERT_EQUAL_INT(MOVEMENT_PHASE_AGREED, state.phase);
        in.omega += sign;
        steps(1);
        ended_by(MOVEMENT_FAILURE_FAST);
    }
}

/* The current needs 3 steps to 300, then 5 steps count. */
void test_a_current_that_turns_nothing_ends_the_movement(void)
{
    begun(MOVEMENT_SPIN);
    request.i.q = 300;
    steps(7);
    TEST_ASSERT_EQUAL_INT(MOVEMENT_PHASE_AGREED, state.phase);
    in.omega = -config.omega_still; /* it turns: the count begins anew */
    steps(1);
    in.omega = 0;
    steps(4);
    TEST_ASSERT_EQUAL_INT(MOVEMENT_PHASE_AGREED, state.phase);
    steps(1);
    ended_by(MOVEMENT_FAILURE_BLOCKED);
    begun(MOVEMENT_SPIN);
    request.i.q = 299;
    steps(40);
    TEST_ASSERT_EQUAL_INT(MOVEMENT_PHASE_AGREED, state.phase);
    begun(MOVEMENT_IMPOSED); /* there it says nothing about the rotor */
    request.i.q = 1000;
    steps(40);
    TEST_ASSERT_EQUAL_INT(MOVEMENT_PHASE_AGREED, state.phase);
}

void test_a_movement_ends_after_its_longest_time_with_switching_enabled(void)
{
    begun(MOVEMENT_IMPOSED);
    in.runs = false;
    steps(100);
    in.runs = true;
    steps(50);
    TEST_ASSERT_EQUAL_INT(MOVEMENT_PHASE_AGREED, state.phase);
    steps(1);
    ended_by(MOVEMENT_FAILURE_LONG);
}
