/* SPDX-License-Identifier: Apache-2.0 */
/* Sine and cosine with variables as the converters' registers, and the angle against atan2() in double precision. */
#include <math.h>
#include <string.h>

#include "hal/angle.h"
#include "hal/s32k144/angle.h"
#include "hal/s32k144/core.h"
#include "hal/s32k144/registers.h"
#include "hal/s32k144/sampling.h"
#include "hal/s32k144/sincos.h"
#include "unity.h"
#include "worst.h"

#define PERIOD 11200U
#define SAMPLED 345.0 /* ticks: three starts of 3, two conversions of 38 clocks of 4, a sample of 8 clocks */
#define TURN_RAD 6.283185307179586
#define Q32 4294967296.0
#define ERROR_RAD 2e-5 /* of sincos_angle(): 1.15e-5 of the polynomial, 7.6e-6 of the quotient */
#define COUNT_RAD 9e-4 /* half a count of each track, 1.5/16384 of the scaling */

adc_t fake_ADC0, fake_ADC1;
static angle_counts_t first[2];
static uint32_t passed;
static int calibrated, converted;

void core_pass(uint32_t clocks)
{
    passed += clocks;
}

void sampling_first_calibrate(void)
{
    calibrated++;
}

angle_counts_t sampling_first_angle(void)
{
    return first[converted++ & 1];
}

static uint32_t count(double share)
{
    return (uint32_t)floor(2048.0 + 1638.0 * share + 0.5);
}

static void counts(uint32_t sine, uint32_t cosine)
{
    memcpy((void *)(uintptr_t)&fake_ADC0.R[SAMPLING_ANGLE], &sine, sizeof sine);
    memcpy((void *)(uintptr_t)&fake_ADC1.R[SAMPLING_ANGLE], &cosine, sizeof cosine);
}

static uint32_t read_counts(uint32_t sine, uint32_t cosine)
{
    counts(sine, cosine);
    return hal_angle_read();
}

static uint32_t read_turns(double turns, double length)
{
    return read_counts(count(length * sin(turns * TURN_RAD)), count(length * cos(turns * TURN_RAD)));
}

static double error_rad(uint32_t angle, double expected_rad)
{
    return (double)(int32_t)(angle - (uint32_t)(int64_t)llround(expected_rad / TURN_RAD * Q32)) / Q32 * TURN_RAD;
}

void setUp(void)
{
    calibrated = converted = 0;
    passed = 0;
    angle_init(PERIOD);
}

void tearDown(void)
{
}

/* Every angle of 16 bits at the ends and in the middle of the band, and beyond. */
void test_the_angle_is_that_of_atan2(void)
{
    static const double lengths[] = {0.05, 0.79, 1.0, 1.21, 1.99};
    double worst = 0.0;
    for (unsigned k = 0; k < sizeof lengths / sizeof lengths[0]; k++) {
        for (int n = 0; n < 65536; n++) {
            const double at = n / 65536.0 * TURN_RAD;
            const sincos_t scaled = {(int32_t)lround(16384.0 * lengths[k] * sin(at)),
                                     (int32_t)lround(16384.0 * lengths[k] * cos(at))};
            worst = worse_of(worst, fabs(error_rad(sincos_angle(scaled), atan2(scaled.sine, scaled.cosine))));
        }
    }
    TEST_ASSERT_TRUE(worst < ERROR_RAD);
    TEST_ASSERT_TRUE(worst > 1e-5); /* the bound is not loose */
}

void test_the_axes_and_diagonals_are_in_their_octants(void)
{
    static const int32_t at[8][2] = {{0, 1}, {1, 1}, {1, 0}, {1, -1}, {0, -1}, {-1, -1}, {-1, 0}, {-1, 1}};
    for (unsigned k = 0; k < 8U; k++) {
        const sincos_t scaled = {SINCOS_ONE * at[k][0], SINCOS_ONE * at[k][1]};
        TEST_ASSERT_DOUBLE_WITHIN(ERROR_RAD, 0.0, error_rad(sincos_angle(scaled), k / 8.0 * TURN_RAD));
    }
}

/* Every pair of lengths at a third of a degree: inside 0.79 ... 1.21 valid, outside not. */
void test_the_band_is_about_the_nominal_length(void)
{
    for (int degree = 0; degree < 360; degree++) {
        const double at = degree / 360.0 * TURN_RAD + 0.3;
        for (int permille = 0; permille <= 1980; permille += 10) {
            const sincos_t scaled = {(int32_t)lround(16.384 * permille * sin(at)),
                                     (int32_t)lround(16.384 * permille * cos(at))};
            if (permille != 790 && permille != 1210) { /* the ends themselves depend on the rounding */
                TEST_ASSERT_EQUAL(permille > 790 && permille < 1210, sincos_is_valid(scaled));
            }
        }
    }
}

/* A track at either end of the range is found whatever the other one is. */
void test_an_open_or_shorted_track_is_outside_the_band_at_every_angle(void)
{
    static const uint32_t ends[] = {0, 4095};
    for (unsigned k = 0; k < 2U; k++) {
        for (uint32_t other = 0; other < 4096U; other++) {
            TEST_ASSERT_FALSE(sincos_is_valid(sincos_scaled(ends[k], other)));
            TEST_ASSERT_FALSE(sincos_is_valid(sincos_scaled(other, ends[k])));
        }
    }
}

/* The derivation of the band, at its corners: every tolerance at its end at once stays valid at every angle. */
void test_every_tolerance_at_once_is_still_valid(void)
{
    for (int corner = 0; corner < 64; corner++) {
        const double sign[6] = {(corner & 1) ? 1 : -1, (corner & 2) ? 1 : -1,  (corner & 4) ? 1 : -1,
                                (corner & 8) ? 1 : -1, (corner & 16) ? 1 : -1, (corner & 32) ? 1 : -1};
        for (int degree = 0; degree < 360; degree++) {
            const double at = degree / 360.0 * TURN_RAD;
            const double length = 1.0 + 0.12 * sign[0];
            const double s = length * (1.0 + 0.015 * sign[1]) * sin(at + TURN_RAD / 360.0 * sign[2]) + 0.03 * sign[3];
            const double c = length * (1.0 - 0.015 * sign[1]) * cos(at) + 0.03 * sign[4];
            const double noise = 4.0 / 1638.0 * sign[5];
            TEST_ASSERT_TRUE(sincos_is_valid(sincos_scaled(count(s + noise), count(c + noise))));
        }
    }
}

void test_at_rest_the_angle_is_that_of_the_counts(void)
{
    for (int n = 0; n < 1000; n++) {
        const double turns = n / 1000.0 + 0.0003;
        angle_init(PERIOD);
        TEST_ASSERT_DOUBLE_WITHIN(COUNT_RAD, 0.0, error_rad(read_turns(turns, 1.0), turns * TURN_RAD));
        TEST_ASSERT_FALSE(angle_fault());
    }
    TEST_ASSERT_TRUE(hal_angle_is_absolute());
    TEST_ASSERT_EQUAL_UINT32(0, angle_follow_index());
}

/* The tracks are sampled 345 ticks after the start of the period. At 1/64 of a turn per period that is 3 mrad. */
void test_the_travel_until_the_sample_is_subtracted(void)
{
    for (int sign = -1; sign <= 1; sign += 2) {
        angle_init(PERIOD);
        (void)read_turns(0.4, 1.0);
        const double now = 0.4 + sign / 64.0, start = now - sign / 64.0 * SAMPLED / PERIOD;
        TEST_ASSERT_DOUBLE_WITHIN(1.1 * COUNT_RAD, 0.0, error_rad(read_turns(now, 1.0), start * TURN_RAD));
    }
}

void test_a_sample_outside_the_band_is_predicted_and_the_third_is_a_fault(void)
{
    static const double lengths[] = {0.7, 1.24};
    for (unsigned k = 0; k < 2U; k++) {
        angle_init(PERIOD);
        (void)read_turns(0.10, 1.0);
        uint32_t last = read_turns(0.11, 1.0);
        for (uint32_t n = 1; n <= 3; n++) {
            const uint32_t now = read_turns(0.3, lengths[k]);
            TEST_ASSERT_DOUBLE_WITHIN(2.0 * COUNT_RAD, 0.01 * TURN_RAD, error_rad(now - last, 0.0));
            TEST_ASSERT_EQUAL(n == 3, angle_fault());
            last = now;
        }
        (void)read_turns(0.15, 1.0);
        TEST_ASSERT_FALSE(angle_fault());
    }
}

/* The travel of a gap is not taken as that of a period. */
void test_the_travel_is_not_measured_across_a_gap(void)
{
    (void)read_turns(0.10, 1.0);
    (void)read_turns(0.11, 1.0);
    (void)read_counts(0, 0);
    (void)read_turns(0.20, 1.0);
    const uint32_t last = read_counts(0, 0);
    TEST_ASSERT_DOUBLE_WITHIN(2.0 * COUNT_RAD, 0.21 * TURN_RAD,
                              error_rad(last, 0.0) + 0.01 * TURN_RAD * SAMPLED / PERIOD);
}

void test_a_first_sample_outside_the_band_is_a_fault(void)
{
    TEST_ASSERT_TRUE(angle_fault());
    (void)read_counts(2048, 2048);
    TEST_ASSERT_TRUE(angle_fault());
    (void)read_turns(0.7, 1.0);
    TEST_ASSERT_FALSE(angle_fault());
}

/* 0.1 ms, 12 mrad: 19 turns per second. */
void test_the_first_speed_is_that_of_two_angles(void)
{
    for (int sign = -1; sign <= 1; sign += 2) {
        first[0] = (angle_counts_t){count(sin(1.0)), count(cos(1.0))};
        first[1] = (angle_counts_t){count(sin(1.0 + sign * 0.012)), count(cos(1.0 + sign * 0.012))};
        TEST_ASSERT_FLOAT_WITHIN(3.0F, 19.1F, angle_first_speed());
    }
    TEST_ASSERT_EQUAL(2, calibrated);
    TEST_ASSERT_EQUAL_UINT32(9600, passed); /* 2 x 0.1 ms of 48 MHz */
    first[1] = (angle_counts_t){0, 2048};
    TEST_ASSERT_TRUE(angle_first_speed() < 0.0F);
}
