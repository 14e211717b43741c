/* SPDX-License-Identifier: Apache-2.0 */
/* With constant inductances the torque is bilinear in the currents, so that interpolation in the coarse table is exact:
 * t = psi_f i_q + (l_d - l_q) i_d i_q, here with psi_f = 0.2 and l_d - l_q = -0.3. */
#include <math.h>
#include <stdlib.h>

#include "comm/e2e.h"
#include "second_level/second_level.h"
#include "unity.h"

#define ONE 32768.0
#define PI 3.14159265358979323846
#define THIRD (2.0 * PI / 3.0)
#define PERIODS 5 /* in a step */

static second_level_constants_t constants;
static second_level_t level;
static second_level_in_t in;

static double torque(double i_d, double i_q)
{
    return 0.2 * i_q - 0.3 * i_d * i_q;
}

void setUp(void)
{
    constants = (second_level_constants_t){.torque_per_count = 10 << 16,
                                           .torque_max = 15000,
                                           .fall = 100,
                                           .tolerance = 600,
                                           .tolerance_share = 1024,
                                           .alpha_per_count = 21845, /* a converter of 16 bits */
                                           .beta_per_count = 37837,
                                           .psi_f = 6554,
                                           .l_d = 6554, /* l_q = 0.4 */
                                           .mean_flux = 52429,
                                           .mean_share = 38809, /* of 5 periods in a step */
                                           .pole_pairs = 3,
                                           .turn_standstill = 1000,
                                           .mean_shift = 2,
                                           .hold_steps = 5,
                                           .confirm_steps = 15};
    for (int d = 0; d < SECOND_LEVEL_ROWS; d++) {
        for (int q = 0; q < SECOND_LEVEL_COLUMNS; q++) {
            constants.torque[d * SECOND_LEVEL_COLUMNS + q] = (int16_t)lrint(ONE * torque((d - 16) / 16.0, q / 16.0));
        }
    }
    level = (second_level_t){0};
    in = (second_level_in_t){.acting = true, .slew = 32767, .elapsed_us = 1000};
}

void tearDown(void)
{
}

static uint32_t count(double i)
{
    return (uint32_t)lrint(ONE * (1.0 + i));
}

/* The sample of a current in the rotor frame at a mechanical angle. */
static second_level_sample_t sample(double i_d, double i_q, double theta_m)
{
    const double e = 3.0 * theta_m + (double)constants.angle_offset / 4294967296.0 * 2.0 * PI;
    return (second_level_sample_t){.counts = {.i_a = count(i_d * cos(e) - i_q * sin(e)),
                                              .i_b = count(i_d * cos(e - THIRD) - i_q * sin(e - THIRD)),
                                              .i_c = count(i_d * cos(e + THIRD) - i_q * sin(e + THIRD))},
                                   .theta_m = (uint32_t)(int64_t)lrint(theta_m / (2.0 * PI) * 4294967296.0)};
}

/* Rounding of the table 1/2 LSB, of the interpolation 1/2, of each current 1 LSB times its slope, which is below 1. */
void test_the_own_torque_is_that_of_the_machine_at_every_angle_and_current(void)
{
    for (int n = 0; n < 5000; n++) {
        const double i_d = -0.7 + 0.75 * ((n * 37) % 1000) / 1000.0;
        const double i_q = -0.65 + 1.3 * ((n * 71) % 1000) / 1000.0;
        const second_level_sample_t at = sample(i_d, i_q, ((n * 13) % 628) / 100.0);
        TEST_ASSERT_INT32_WITHIN(4, (int32_t)lrint(ONE * torque(i_d, i_q)),
                                 second_level_own_torque(&constants, &at, 0));
    }
}

void test_the_offset_of_the_angle_belongs_to_the_electrical_angle(void)
{
    constants.angle_offset = 500000000U;
    const second_level_sample_t at = sample(-0.3, 0.4, 1.0);
    TEST_ASSERT_INT32_WITHIN(4, (int32_t)lrint(ONE * torque(-0.3, 0.4)), second_level_own_torque(&constants, &at, 0));
}

/* The state of the reception while the vehicle requests this torque all the time. */
static void request(int32_t torque_counts)
{
    level.frames.command = (second_level_channel_t){.alive = true, .seen = true};
    level.frames.torque_counts = torque_counts;
    level.frames.drive_counts = 10000;
    level.frames.regen_counts = 10000;
}

static int steps_to_fault(int steps_max)
{
    for (int n = 1; n <= steps_max; n++) {
        level.frames.command.age_us = 0;
        if (second_level_step(&constants, &level, &in)) {
            return n;
        }
    }
    return 0;
}

/* i_q = 0.3 makes a torque of 0.06, 1966 counts; 1000 + 600 + 1000/64 counts are permitted. */
void test_torque_beyond_the_request_is_reported_and_stays_reported(void)
{
    request(100);
    in.sample = sample(0.0, 0.3, 0.0);
    const int found = steps_to_fault(100);
    TEST_ASSERT_GREATER_OR_EQUAL_INT(15, found);
    TEST_ASSERT_LESS_OR_EQUAL_INT(25, found); /* the mean takes some steps */
    TEST_ASSERT_EQUAL_INT(1, steps_to_fault(1));
}

void test_torque_within_the_tolerance_is_not_reported(void)
{
    request(140);
    in.sample = sample(0.0, 0.3, 0.0);
    TEST_ASSERT_EQUAL_INT(0, steps_to_fault(500));
}

void test_torque_against_the_request_is_reported(void)
{
    request(2000);
    in.sample = sample(0.0, -0.12, 0.0); /* 786 counts */
    TEST_ASSERT_GREATER_THAN_INT(0, steps_to_fault(100));
}

void test_too_little_torque_is_not_reported(void)
{
    request(1500);
    TEST_ASSERT_EQUAL_INT(0, steps_to_fault(500));
}

/* 1966 counts; a magnet that has lost a sixth of its flux makes 1638, less than 1030 + 600 + 16 are permitted. */
void test_an_identified_loss_of_the_magnet_counts(void)
{
    request(103);
    in.sample = sample(0.0, 0.3, 0.0);
    TEST_ASSERT_GREATER_THAN_INT(0, steps_to_fault(500));
    level.confirmed_steps = 0;
    in.sample.psi_d_error = -1092;
    TEST_ASSERT_EQUAL_INT(0, steps_to_fault(500));
}

static int32_t torque_with(double i_d, double i_q, int32_t psi_d_error, int32_t lq_error)
{
    second_level_sample_t at = sample(i_d, i_q, 1.0);
    at.psi_d_error = psi_d_error;
    at.lq_error = lq_error;
    return second_level_own_torque(&constants, &at, 0);
}

/* psi_q = 0.4 i_q, psi_d = 0.2 + 0.1 i_d: 10 % less of psi_q are 0.04 i_q |i_d| less torque, in both directions. */
void test_the_identified_deviations_change_the_torque_as_in_the_machine(void)
{
    for (int sign = -1; sign <= 1; sign += 2) {
        const double i_q = sign * 0.5;
        TEST_ASSERT_INT32_WITHIN(6, (int32_t)lrint(ONE * (torque(-0.4, i_q) - 0.04 * i_q * 0.4)),
                                 torque_with(-0.4, i_q, 0, -3277));
        TEST_ASSERT_INT32_WITHIN(6, (int32_t)lrint(ONE * (torque(-0.4, i_q) - 0.02 * i_q)),
                                 torque_with(-0.4, i_q, -655, 0));
    }
}

/* A healthy machine makes no more than the table's torque for the monitor, and at least four fifths of it. */
void test_the_deviations_count_only_as_far_as_a_healthy_machine_can_have_them(void)
{
    const int32_t table = torque_with(-0.3, 0.5, 0, 0);
    TEST_ASSERT_EQUAL_INT32(table, torque_with(-0.3, 0.5, 3000, 3000));
    TEST_ASSERT_EQUAL_INT32(table - table / 5, torque_with(-0.3, 0.5, -32768, 0));
    TEST_ASSERT_INT32_WITHIN(2, -(table - table / 5), torque_with(-0.3, -0.5, -32768, -32768));
}

/* The mean over a period of the torque of a machine with psi_f = 0.2, l_d = 0.1, l_q = 0.4, with these currents at
 * both of its ends: the voltage is constant, so that the flux in the stator's frame moves along a straight line. */
static double mean_torque(double i_d, double i_q, double theta)
{
    enum { PARTS = 2000 };
    const double psi_d = 0.2 + 0.1 * i_d, psi_q = 0.4 * i_q;
    double sum = 0.0;
    for (int n = 0; n < PARTS; n++) {
        const double s = (n + 0.5) / PARTS, back = -s * theta, on = theta - s * theta;
        const double d = (1.0 - s) * (psi_d * cos(back) - psi_q * sin(back)) + s * (psi_d * cos(on) - psi_q * sin(on));
        const double q = (1.0 - s) * (psi_d * sin(back) + psi_q * cos(back)) + s * (psi_d * sin(on) + psi_q * cos(on));
        sum += d * q / 0.4 - q * (d - 0.2) / 0.1;
    }
    return sum / PARTS;
}

/* The change of the mechanical angle in a step in which the field turns by theta in each period. */
static int32_t turn_of(double theta)
{
    return (int32_t)lrint(PERIODS * theta / 3.0 / (2.0 * PI) * 4294967296.0);
}

static int32_t turning_torque(double i_d, double i_q, double theta)
{
    const second_level_sample_t at = sample(i_d, i_q, 1.0);
    return second_level_own_torque(&constants, &at, turn_of(theta));
}

/* What is left out is of the order of theta^2/12 of the correction, 3 % at 0.6: a mean shorter by more than theta^2/12,
 * and the product of what flux and current change within the period. */
void test_in_field_weakening_the_torque_is_the_mean_over_the_period(void)
{
    for (int n = 0; n < 400; n++) {
        const double theta = -0.6 + 1.2 * ((n * 37) % 400) / 400.0, i_d = -0.9 + 0.15 * ((n * 71) % 100) / 100.0;
        const double i_q = 0.4 * ((n % 2) ? 1.0 : -1.0), mean = mean_torque(i_d, i_q, theta);
        const double loss = fabs(torque(i_d, i_q) - mean);
        TEST_ASSERT_DOUBLE_WITHIN(6.0 + 0.04 * ONE * loss, ONE * mean, turning_torque(i_d, i_q, theta));
    }
}

/* Where reluctance makes the mean larger than the samples, the torque at the samples counts. */
void test_a_turning_field_never_adds_torque(void)
{
    TEST_ASSERT_TRUE(mean_torque(-0.1, 0.5, 0.6) > torque(-0.1, 0.5));
    TEST_ASSERT_EQUAL_INT32(torque_with(-0.1, 0.5, 0, 0), turning_torque(-0.1, 0.5, 0.6));
    TEST_ASSERT_EQUAL_INT32(torque_with(-0.1, -0.5, 0, 0), turning_torque(-0.1, -0.5, -0.6));
}

/* What does not change is psi_q psi_f/l_d = 0.32. */
void test_at_most_a_sixteenth_of_what_changes_is_taken_off(void)
{
    const int32_t at_samples = torque_with(-0.9, 0.4, 0, 0);
    const int32_t most = at_samples - (2 * at_samples - 10486) / 16;
    TEST_ASSERT_INT32_WITHIN(2, most, turning_torque(-0.9, 0.4, 0.9));
    const second_level_sample_t at = sample(-0.9, 0.4, 1.0);
    TEST_ASSERT_INT32_WITHIN(2, most, second_level_own_torque(&constants, &at, INT32_MAX));
    TEST_ASSERT_INT32_WITHIN(2, most, second_level_own_torque(&constants, &at, INT32_MIN));
}

/* i_alpha = 2/3 and i_beta = 1 of the full scale, a length of 1.2: at some angles all of it is i_q. An eighth of the
 * torque is a sixteenth of 2 s, the largest that can change. */
void test_beyond_the_full_scale_at_most_an_eighth_is_taken_off(void)
{
    static const current_counts_t counts[] = {{65535, 65535, 0}, {0, 0, 65535}};
    int beyond = 0;
    for (int n = 0; n < 2000; n++) {
        const double angle = 2.0 * PI * (n % 1000) / 1000.0, sign = (n < 1000) ? 1.0 : -1.0;
        const double i_q = sign * (cos(angle) - 2.0 / 3.0 * sin(angle));
        const second_level_sample_t at = {.counts = counts[n / 1000],
                                          .theta_m = (uint32_t)(angle / 3.0 / (2.0 * PI) * 4294967296.0)};
        const int32_t at_samples = abs(second_level_own_torque(&constants, &at, 0));
        const int32_t turning = abs(second_level_own_torque(&constants, &at, INT32_MAX));
        TEST_ASSERT_GREATER_OR_EQUAL_INT32(at_samples - at_samples / 8 - 1, turning);
        TEST_ASSERT_LESS_OR_EQUAL_INT32(at_samples, turning);
        beyond += fabs(i_q) > 1.0;
    }
    TEST_ASSERT_GREATER_THAN_INT(600, beyond);
}

void test_the_field_turns_as_the_angle_did_since_the_last_step(void)
{
    in.sample = sample(-0.9, 0.4, 1.0);
    level.theta_m = in.sample.theta_m - (uint32_t)turn_of(0.6);
    (void)second_level_step(&constants, &level, &in);
    TEST_ASSERT_EQUAL_INT32(64 * turning_torque(-0.9, 0.4, 0.6), level.mean_q8);
}

/* Against the direction of i_q: with more reluctance torque than magnet torque, as a table may say at its edge. */
void test_nothing_is_taken_from_a_torque_against_its_current(void)
{
    for (int n = 0; n < SECOND_LEVEL_ROWS * SECOND_LEVEL_COLUMNS; n++) {
        constants.torque[n] = -3000;
    }
    TEST_ASSERT_EQUAL_INT32(-3000, torque_with(-0.3, 0.5, -2000, -2000));
}

void test_while_the_bridge_does_not_switch_nothing_is_reported(void)
{
    request(0);
    in.sample = sample(0.0, 0.3, 0.0);
    in.acting = false;
    TEST_ASSERT_EQUAL_INT(0, steps_to_fault(500));
    in.acting = true;
    TEST_ASSERT_GREATER_THAN_INT(14, steps_to_fault(500));
}

/* A table without torque of the magnet, t = |i_q|, shows the current itself. At an angle of 2^-17 of a turn the sine is
 * the next one: 3 counts of 2^15, so that i_alpha = 0.6 has i_q = -2. */
void test_the_angle_is_rounded_to_the_nearest_of_65536(void)
{
    for (int n = 0; n < SECOND_LEVEL_ROWS * SECOND_LEVEL_COLUMNS; n++) {
        constants.torque[n] = (int16_t)(2047 * (n % SECOND_LEVEL_COLUMNS));
    }
    constants.pole_pairs = 1;
    second_level_sample_t at = sample(0.6, 0.0, 0.0);
    at.theta_m = 0x7FFFU;
    TEST_ASSERT_EQUAL_INT32(0, second_level_own_torque(&constants, &at, 0));
    at.theta_m = 0x8000U;
    TEST_ASSERT_EQUAL_INT32(-2, second_level_own_torque(&constants, &at, 0));
}

/* i_beta = 1000/sqrt(3) = 577.3, of which the cosine of 0 degrees, 32767/32768, leaves 576 after rounding down; the
 * table is t = |i_q| here. */
void test_a_column_of_the_table_is_a_sixteenth_of_the_current(void)
{
    for (int n = 0; n < SECOND_LEVEL_ROWS * SECOND_LEVEL_COLUMNS; n++) {
        constants.torque[n] = (int16_t)(2048 * (n % SECOND_LEVEL_COLUMNS % 16));
    }
    const second_level_sample_t at = {.counts = {32768, 32768 + 500, 32768 - 500}};
    TEST_ASSERT_EQUAL_INT32(576, second_level_own_torque(&constants, &at, 0));
}

/* The sign of the torque is that of i_q; without i_q the table counts as it is. */
void test_without_current_across_the_magnet_the_table_counts_as_it_is(void)
{
    for (int n = 0; n < SECOND_LEVEL_ROWS * SECOND_LEVEL_COLUMNS; n++) {
        constants.torque[n] = 700;
    }
    second_level_sample_t at = {.counts = {32768, 32768, 32768}};
    TEST_ASSERT_EQUAL_INT32(700, second_level_own_torque(&constants, &at, 0));
    at.counts.i_b -= 1000;
    at.counts.i_c += 1000;
    TEST_ASSERT_EQUAL_INT32(-700, second_level_own_torque(&constants, &at, 0));
}

/* i_q = 0.3, with the mean already there: it stays to a count. */
static int32_t settle_mean(void)
{
    request(100);
    in.sample = sample(0.0, 0.3, 0.0);
    for (int n = 0; n < 100; n++) {
        level.frames.command.age_us = 0;
        (void)second_level_step(&constants, &level, &in);
    }
    return level.mean_q8 >> 8;
}

/* A fourth of the torque in the first step, times 256. */
void test_the_mean_follows_the_torque_with_a_fourth_per_step(void)
{
    in.sample = sample(0.0, 0.3, 0.0);
    (void)second_level_step(&constants, &level, &in);
    TEST_ASSERT_EQUAL_INT32(64 * second_level_own_torque(&constants, &in.sample, 0), level.mean_q8);
}

/* 1000 of the request and 1000/64 of the share leave this tolerance. */
void test_a_torque_of_just_the_bound_is_permitted(void)
{
    for (int below = 0; below <= 1; below++) {
        setUp();
        constants.tolerance = settle_mean() - 1015 - below;
        level.confirmed_steps = 0;
        TEST_ASSERT_EQUAL_INT((below == 1) ? 15 : 0, steps_to_fault(100));
        TEST_ASSERT_EQUAL_INT32((below == 1) ? 15 : 0, level.confirmed_steps);
    }
}

/* However long it lasts, the count stays at that of the confirmation, and the first step below the bound ends it. */
void test_the_count_of_the_confirmation_saturates_and_ends_at_once(void)
{
    (void)settle_mean();
    TEST_ASSERT_EQUAL_INT32(15, level.confirmed_steps);
    constants.tolerance = 32767;
    TEST_ASSERT_EQUAL_INT(0, steps_to_fault(1));
    TEST_ASSERT_EQUAL_INT32(0, level.confirmed_steps);
}

void test_after_switching_was_disabled_mean_and_confirmation_begin_anew(void)
{
    request(100);
    in.sample = sample(0.0, 0.3, 0.0);
    const int first = steps_to_fault(100);
    TEST_ASSERT_GREATER_THAN_INT(0, first);
    in.acting = false;
    TEST_ASSERT_EQUAL_INT(0, steps_to_fault(1));
    TEST_ASSERT_EQUAL_INT32(0, level.mean_q8);
    TEST_ASSERT_EQUAL_INT32(0, level.confirmed_steps);
    in.acting = true;
    TEST_ASSERT_EQUAL_INT(first, steps_to_fault(100));
}

/* Bound of a positive request with 200 counts while driving and 300 while braking; the angle moves across zero. */
static int32_t bound_after(uint32_t before, uint32_t now)
{
    setUp();
    request(500);
    in.sample.theta_m = before;
    (void)second_level_step(&constants, &level, &in);
    level.permitted = (second_level_permitted_t){0};
    level.frames.drive_counts = 200;
    level.frames.regen_counts = 300;
    in.sample.theta_m = now;
    (void)second_level_step(&constants, &level, &in);
    return level.permitted.positive.bound;
}

void test_the_direction_of_rotation_is_that_of_the_last_step(void)
{
    TEST_ASSERT_EQUAL_INT32(2000, bound_after(0xF0000000U, 0xF0001388U));
    TEST_ASSERT_EQUAL_INT32(2000, bound_after(0xFFFFF000U, 0x00001000U));
    TEST_ASSERT_EQUAL_INT32(3000, bound_after(0x10001388U, 0x10000000U));
    TEST_ASSERT_EQUAL_INT32(3000, bound_after(0x00001000U, 0xFFFFF000U));
}

/* (QA-2): each part multiplies the signature, which the question begins. */
void test_the_signature_has_all_parts_whether_the_bridge_switches_or_not(void)
{
    uint32_t expected = 9;
    for (uint32_t part = 0x51; part <= 0x53; part++) {
        expected = (expected ^ part) * 16777619U;
    }
    in.question = 9;
    for (int k = 0; k < 2; k++) {
        in.acting = k == 1;
        (void)second_level_step(&constants, &level, &in);
        TEST_ASSERT_EQUAL_HEX32(expected, level.flow);
    }
}
