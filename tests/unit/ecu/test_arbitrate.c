/* SPDX-License-Identifier: Apache-2.0 */
#include "ecu/arbitration.h"

#include <stdlib.h>

#include "unity.h"

/* Full torque of 16000 counts in 40 ms, full slew in 10 ms, ramp from full torque to zero in 15 ms; dead band of 28
 * counts. */
#define COUNT 65536
#define SLEW (400 * COUNT)
#define JERK (40 * COUNT)
#define RAMP_OUT (1067 * COUNT)

static const arbitrate_config_t config = {SLEW, JERK, RAMP_OUT, 28, 1000000};
static arbitrate_state_t state;
static arbitrate_in_t in;

void setUp(void)
{
    state = (arbitrate_state_t){0};
    in = (arbitrate_in_t){.limit_drive = 20000, .limit_regen = 20000, .run = true};
}

void tearDown(void)
{
}

static q15_t step(void)
{
    return arbitrate_step(&config, &state, &in);
}

static q15_t steps(int count)
{
    q15_t last = 0;
    for (int n = 0; n < count; n++) {
        last = step();
    }
    return last;
}

/* 16000/400 = 40 steps at full slew and half of 10 more at either end. */
void test_full_torque_takes_slew_and_jerk_time_and_is_reached_exactly(void)
{
    in.torque_requested = 16000;
    TEST_ASSERT_LESS_THAN_INT(16000, steps(48));
    TEST_ASSERT_EQUAL_INT(16000, steps(4));
    TEST_ASSERT_EQUAL_INT(16000, steps(100));
    TEST_ASSERT_EQUAL_INT32(0, state.rate);
}

/* From any torque to any other, with the target changed on the way. */
void test_rate_and_its_growth_stay_within_slew_and_jerk_and_nothing_overshoots(void)
{
    srand(1);
    q31_t rate_before = 0;
    for (int n = 0; n < 200000; n++) {
        if (n % 37 == 0) {
            in.torque_requested = (q15_t)(rand() % 32001 - 16000);
        }
        const q31_t before = state.torque_arbitrated;
        (void)step();
        const q31_t wanted = (abs(in.torque_requested) <= 28) ? 0 : in.torque_requested * COUNT;
        const int64_t moved = (int64_t)state.torque_arbitrated - before;
        TEST_ASSERT_TRUE(llabs(moved) <= SLEW);
        /* The torque moves towards the target and never past it. */
        TEST_ASSERT_TRUE((moved >= 0) == (wanted >= before) || moved == 0);
        TEST_ASSERT_TRUE(llabs((int64_t)wanted - state.torque_arbitrated) <= llabs((int64_t)wanted - before));
        /* The rate grows by one jerk at most; after a change of direction it starts at zero. */
        TEST_ASSERT_TRUE(llabs(moved) <= labs(rate_before) + JERK);
        rate_before = (q31_t)moved;
    }
}

/* The rate falls with the jerk before the target: the last step is at most two jerks. */
void test_the_rate_falls_with_the_jerk_before_the_target(void)
{
    for (int target = 100; target <= 16000; target += 173) {
        setUp();
        in.torque_requested = (q15_t)target;
        q31_t last = 0;
        while (state.torque_arbitrated != target * COUNT) {
            last = state.torque_arbitrated;
            (void)step();
        }
        TEST_ASSERT_TRUE(state.torque_arbitrated - last <= 2 * JERK);
    }
}

void test_a_request_of_zero_stops_the_rise_at_once(void)
{
    in.torque_requested = 16000;
    const q15_t before = steps(20);
    in.torque_requested = 0;
    TEST_ASSERT_LESS_THAN_INT(before, step());
}

/* The dead band is 28 counts: a request within it, of either sign, must not make the vehicle creep. */
void test_requests_within_the_dead_band_are_exactly_zero(void)
{
    for (int request = -28; request <= 28; request++) {
        in.torque_requested = (q15_t)request;
        TEST_ASSERT_EQUAL_INT(0, steps(3));
        TEST_ASSERT_EQUAL_INT32(0, state.torque_arbitrated);
    }
    in.torque_requested = 29;
    TEST_ASSERT_EQUAL_INT(29, steps(3));
    in.torque_requested = -29;
    TEST_ASSERT_EQUAL_INT(-29, steps(5));
}

void test_four_quadrants_drive_and_brake_with_their_own_limits(void)
{
    in.limit_drive = 9000;
    in.limit_regen = 3000;
    const struct {
        q15_t request;
        q31_t omega;
        int wanted;
    } quadrants
        [] =
            {
                {16000, 1 << 28, 9000},      {-16000, 1 << 28, -3000}, {16000, -(1 << 28), 3000},
                {-16000, -(1 << 28), -9000}, {16000, 0, 9000},         {-16000, 0, -9000},
                {-16000, 900000, -9000}, /* below the speed of standstill a torque against the rotation is driving */
    };
    for (unsigned n = 0; n < sizeof quadrants / sizeof quadrants[0]; n++) {
        state = (arbitrate_state_t){0};
        in.torque_requested = quadrants[n].request;
        in.omega = quadrants[n].omega;
        TEST_ASSERT_EQUAL_INT(quadrants[n].wanted, steps(100));
    }
}

void test_a_limit_that_falls_reduces_the_torque_with_slew(void)
{
    in.torque_requested = 16000;
    (void)steps(100);
    in.limit_drive = 1000;
    const q15_t first = step();
    TEST_ASSERT_GREATER_THAN_INT(15000, first);
    TEST_ASSERT_EQUAL_INT(1000, steps(100));
}

/* The ramp takes full torque of either sign to zero in 15 steps, without a jerk limit. */
void test_the_ramp_out_ends_full_torque_within_15_steps(void)
{
    for (int sign = -1; sign <= 1; sign += 2) {
        setUp();
        in.torque_requested = (q15_t)(16000 * sign);
        (void)steps(100);
        in.ramp_out = true;
        TEST_ASSERT_NOT_EQUAL_INT(0, steps(14));
        TEST_ASSERT_EQUAL_INT(0, step());
    }
}

void test_a_stop_ends_the_torque_with_slew_and_off_at_once(void)
{
    in.torque_requested = 16000;
    (void)steps(100);
    in.stop = true;
    TEST_ASSERT_GREATER_THAN_INT(0, steps(40));
    TEST_ASSERT_EQUAL_INT(0, steps(12));
    in.stop = false;
    (void)steps(100);
    in.run = false;
    TEST_ASSERT_EQUAL_INT(0, step());
    in.run = true;
    TEST_ASSERT_LESS_OR_EQUAL_INT(40, step()); /* it starts again from zero */
}

/* The most negative count has no positive counterpart. */
void test_the_ends_of_the_format_do_not_overflow(void)
{
    in = (arbitrate_in_t){
        .torque_requested = Q15_MIN, .limit_drive = Q15_MAX, .limit_regen = Q15_MAX, .omega = Q31_MIN, .run = true};
    TEST_ASSERT_EQUAL_INT(-Q15_MAX, steps(1000));
    in.torque_requested = Q15_MAX;
    TEST_ASSERT_EQUAL_INT(Q15_MAX, steps(1000));
}

/* The drive limits the torque to 5000 of 16000 counts. When the limit ends, the torque rises from there with a rate
 * that grows by 40 per step. */
void test_torque_that_a_limit_held_back_rises_with_slew_and_jerk_when_the_limit_ends(void)
{
    in.torque_requested = 16000;
    q15_t arbitrated = 0;
    for (int n = 0; n < 200; n++) {
        arbitrate_hold(&config, &state, (q15_t)(arbitrated < 5000 ? arbitrated : 5000));
        arbitrated = step();
        TEST_ASSERT_LESS_OR_EQUAL_INT(5000 + 400, arbitrated); /* at most one step of full slew beyond the limit */
    }
    TEST_ASSERT_EQUAL_INT(5080, arbitrated); /* stays beyond the limit, so that the drive reports the limit */
    q15_t before = 5000;
    q15_t rate = 0;
    while (arbitrated < 16000) {
        TEST_ASSERT_LESS_OR_EQUAL_INT(rate + 81, arbitrated - before);
        rate = (q15_t)(arbitrated - before);
        TEST_ASSERT_LESS_OR_EQUAL_INT(400, rate);
        before = arbitrated;
        arbitrate_hold(&config, &state, arbitrated);
        arbitrated = step();
    }
    TEST_ASSERT_EQUAL_INT(16000, arbitrated);
}

/* From 16000, with a limit that falls by 100 per step, to a request of -16000. Because the rate is kept, the torque is
 * zero after slew and jerk, 16000/400 + 5 steps. If each step started again with the jerk, it would be 180 per step and
 * take 89 steps. */
void test_a_falling_limit_does_not_delay_a_request_in_the_other_direction(void)
{
    in.torque_requested = 16000;
    (void)steps(200);
    in.torque_requested = -16000;
    q15_t limited = 16000;
    int taken = 0;
    for (; fx_q15_from_q31(state.torque_arbitrated) > 0 && taken < 200; taken++) {
        limited = (q15_t)fx_min_s32(fx_max_s32(limited - 100, 0), fx_q15_from_q31(state.torque_arbitrated));
        arbitrate_hold(&config, &state, limited);
        (void)step();
    }
    TEST_ASSERT_LESS_OR_EQUAL_INT(46, taken);
}

void test_a_limit_that_does_not_limit_changes_nothing(void)
{
    in.torque_requested = -12000;
    arbitrate_state_t alone = state;
    for (int n = 0; n < 100; n++) {
        arbitrate_hold(&config, &state, n == 0 ? 0 : fx_q15_from_q31(state.torque_arbitrated));
        (void)step();
        (void)arbitrate_step(&config, &alone, &in);
        TEST_ASSERT_EQUAL_INT32(alone.torque_arbitrated, state.torque_arbitrated);
    }
}

/* Braking begins above the speed of standstill. */
void test_at_the_speed_of_standstill_nothing_brakes(void)
{
    TEST_ASSERT_FALSE(arbitrate_is_braking(&config, 1000000, true));
    TEST_ASSERT_TRUE(arbitrate_is_braking(&config, 1000001, true));
    TEST_ASSERT_FALSE(arbitrate_is_braking(&config, -1000000, false));
    TEST_ASSERT_TRUE(arbitrate_is_braking(&config, -1000001, false));
}

static q15_t step_from(int32_t torque, int32_t rate, int32_t requested)
{
    state = (arbitrate_state_t){.torque_arbitrated = torque * COUNT, .rate = rate * COUNT};
    in.torque_requested = (q15_t)requested;
    return step();
}

/* With the jerk of 40 a rate of 80 stops within 80 + 40 = 120, a rate of 120 within 240. */
void test_the_rate_is_the_largest_that_still_stops_at_the_target(void)
{
    TEST_ASSERT_EQUAL_INT(1080, step_from(1000, 40, 1120));
    TEST_ASSERT_EQUAL_INT(1040, step_from(1000, 40, 1119));
    TEST_ASSERT_EQUAL_INT(1080, step_from(1000, 80, 1200));
    TEST_ASSERT_EQUAL_INT(1120, step_from(1000, 80, 1240));
    TEST_ASSERT_EQUAL_INT(-1080, step_from(-1000, -80, -1200));
}

void test_a_step_that_reaches_the_target_exactly_ends_the_rate(void)
{
    TEST_ASSERT_EQUAL_INT(1040, step_from(1000, 40, 1040));
    TEST_ASSERT_EQUAL_INT32(0, state.rate);
}

void test_a_rate_in_the_other_direction_counts_as_none(void)
{
    TEST_ASSERT_EQUAL_INT(1040, step_from(1000, -400, 8000));
    TEST_ASSERT_EQUAL_INT(960, step_from(1000, 400, -8000));
}

void test_after_ramp_out_and_off_nothing_is_left(void)
{
    in.ramp_out = true;
    (void)step_from(8000, 400, 8000);
    TEST_ASSERT_EQUAL_INT32(0, state.rate);
    in.run = false;
    (void)step_from(8000, 400, 8000);
    TEST_ASSERT_EQUAL_INT32(0, state.torque_arbitrated);
    TEST_ASSERT_EQUAL_INT32(0, state.rate);
}

/* A limit of 5000 leaves one jerk more, with either sign. A rate outwards ends with it, one towards zero does not. */
void test_a_limit_holds_the_torque_of_either_sign(void)
{
    for (int sign = -1; sign <= 1; sign += 2) {
        for (int direction = -1; direction <= 1; direction += 2) {
            const q31_t rate = direction * sign * 80 * COUNT;
            state = (arbitrate_state_t){.torque_arbitrated = sign * 9000 * COUNT, .rate = rate};
            arbitrate_hold(&config, &state, (q15_t)(sign * 5000));
            TEST_ASSERT_EQUAL_INT32(sign * 5040 * COUNT, state.torque_arbitrated);
            TEST_ASSERT_EQUAL_INT32(direction > 0 ? 0 : rate, state.rate);
        }
        state = (arbitrate_state_t){.torque_arbitrated = sign * 5040 * COUNT, .rate = sign * 80 * COUNT};
        arbitrate_hold(&config, &state, (q15_t)(sign * 5000)); /* just not held */
        TEST_ASSERT_EQUAL_INT32(sign * 80 * COUNT, state.rate);
    }
}

void test_a_target_at_the_present_torque_ends_the_rate(void)
{
    for (int sign = -1; sign <= 1; sign += 2) {
        TEST_ASSERT_EQUAL_INT(1000, step_from(1000, sign * 400, 1000));
        TEST_ASSERT_EQUAL_INT32(0, state.rate);
    }
}
