/* SPDX-License-Identifier: Apache-2.0 */
#include "second_level/permitted.h"
#include "unity.h"

/* 10 counts are 0.1 N·m; the bound falls by 100 counts per step; the hold time has parts of 5 steps. */
static const second_level_constants_t constants = {
    .torque_per_count = 10 << 16, .torque_max = 15000, .fall = 100, .turn_standstill = 1000, .hold_steps = 5};
#define TURN 5000
#define OPEN 32767

static second_level_permitted_t permitted;
static second_level_frames_t frames;

void setUp(void)
{
    permitted = (second_level_permitted_t){0};
    frames = (second_level_frames_t){.drive_counts = 10000, .regen_counts = 10000};
}

void tearDown(void)
{
}

static void steps(int count, int32_t turn, int32_t slew)
{
    for (int n = 0; n < count; n++) {
        second_level_permitted_step(&constants, &permitted, &frames, turn, slew);
    }
}

void test_the_band_rises_at_once_on_the_side_of_the_request(void)
{
    frames.torque_counts = 500;
    steps(1, TURN, OPEN);
    TEST_ASSERT_EQUAL_INT32(5000, permitted.positive.bound);
    TEST_ASSERT_EQUAL_INT32(0, permitted.negative.bound);
    frames.torque_counts = -700;
    steps(1, TURN, OPEN);
    TEST_ASSERT_EQUAL_INT32(7000, permitted.negative.bound);
}

/* The bound is held for 15 to 20 steps and then falls by 100 counts per step. */
void test_the_band_falls_after_the_hold_time_at_the_legal_rate(void)
{
    frames.torque_counts = 500;
    steps(20, TURN, OPEN);
    frames.torque_counts = 100;
    steps(15, TURN, OPEN);
    TEST_ASSERT_EQUAL_INT32(5000, permitted.positive.bound);
    steps(6, TURN, OPEN);
    const int32_t start = permitted.positive.bound;
    TEST_ASSERT_LESS_THAN_INT32(5000, start);
    steps(10, TURN, OPEN);
    TEST_ASSERT_EQUAL_INT32(start - 1000, permitted.positive.bound);
    steps(100, TURN, OPEN);
    TEST_ASSERT_EQUAL_INT32(1000, permitted.positive.bound);
}

void test_a_slower_calibrated_slew_makes_the_band_fall_more_slowly(void)
{
    frames.torque_counts = 500;
    steps(1, TURN, OPEN);
    frames.torque_counts = 0;
    steps(21, TURN, 10);
    const int32_t start = permitted.positive.bound;
    steps(10, TURN, 10);
    TEST_ASSERT_EQUAL_INT32(start - 100, permitted.positive.bound);
}

void test_the_limit_of_the_direction_applies(void)
{
    frames.drive_counts = 300;
    frames.regen_counts = 200;
    frames.torque_counts = 500;
    steps(1, TURN, OPEN);
    TEST_ASSERT_EQUAL_INT32(3000, permitted.positive.bound);
    frames.torque_counts = -500;
    steps(1, TURN, OPEN);
    TEST_ASSERT_EQUAL_INT32(2000, permitted.negative.bound);
}

void test_backwards_the_limits_are_those_of_the_other_direction(void)
{
    frames.drive_counts = 300;
    frames.regen_counts = 200;
    frames.torque_counts = 500;
    steps(1, -TURN, OPEN);
    TEST_ASSERT_EQUAL_INT32(2000, permitted.positive.bound);
    frames.torque_counts = -500;
    steps(1, -TURN, OPEN);
    TEST_ASSERT_EQUAL_INT32(3000, permitted.negative.bound);
}

/* Near standstill the sign of the speed may be wrong. */
void test_near_standstill_the_larger_limit_applies(void)
{
    frames.drive_counts = 200;
    frames.regen_counts = 300;
    frames.torque_counts = 500;
    steps(1, 1000, OPEN);
    TEST_ASSERT_EQUAL_INT32(3000, permitted.positive.bound);
    permitted = (second_level_permitted_t){0};
    steps(1, 1001, OPEN);
    TEST_ASSERT_EQUAL_INT32(2000, permitted.positive.bound);
}

void test_up_to_the_turn_of_standstill_in_both_directions_the_larger_limit_applies(void)
{
    static const struct {
        int32_t turn, counts;
    } cases[] = {{999, 300}, {0, 300}, {-999, 300}, {-1000, 300}, {-1001, 200}};
    frames.torque_counts = 500;
    for (unsigned k = 0; k < sizeof cases / sizeof cases[0]; k++) {
        frames.drive_counts = (cases[k].turn < 0) ? 300 : 200;
        frames.regen_counts = 500 - frames.drive_counts; /* the smaller one is that of the positive direction */
        permitted = (second_level_permitted_t){0};
        steps(1, cases[k].turn, OPEN);
        TEST_ASSERT_EQUAL_INT32(10 * cases[k].counts, permitted.positive.bound);
    }
}

/* Parts begin with the steps 5, 10, 15 and 20: with the 20th step the request of the first one leaves the last part. */
void test_a_request_of_one_step_is_held_like_a_longer_one(void)
{
    frames.torque_counts = 500;
    steps(1, TURN, OPEN);
    frames.torque_counts = 0;
    for (int n = 0; n < 18; n++) {
        steps(1, TURN, OPEN);
        TEST_ASSERT_EQUAL_INT32(5000, permitted.positive.bound);
    }
    steps(1, TURN, OPEN);
    TEST_ASSERT_EQUAL_INT32(4900, permitted.positive.bound);
}

/* A count of half of the format's step is rounded up, one of 2^-16 less down. */
void test_a_count_is_rounded_to_the_nearest_step_of_the_format(void)
{
    second_level_constants_t fine = constants;
    for (int k = 0; k < 2; k++) {
        fine.torque_per_count = 0x7FFF + k;
        frames.torque_counts = 1;
        permitted = (second_level_permitted_t){0};
        second_level_permitted_step(&fine, &permitted, &frames, TURN, OPEN);
        TEST_ASSERT_EQUAL_INT32(k, permitted.positive.bound);
    }
}

void test_no_limit_permits_more_than_the_rated_torque(void)
{
    frames.torque_counts = 9000;
    steps(1, TURN, OPEN);
    TEST_ASSERT_EQUAL_INT32(15000, permitted.positive.bound);
}

void test_lost_limits_of_the_battery_permit_no_torque(void)
{
    frames.torque_counts = 500;
    frames.battery.seen = true;
    steps(1, TURN, OPEN);
    TEST_ASSERT_EQUAL_INT32(0, permitted.positive.bound);
    frames.battery.alive = true;
    steps(1, TURN, OPEN);
    TEST_ASSERT_EQUAL_INT32(5000, permitted.positive.bound);
}
