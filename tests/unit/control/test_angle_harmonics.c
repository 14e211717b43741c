/* SPDX-License-Identifier: Apache-2.0 */
#include <math.h>
#include <string.h>

#include "control/adapt/angle_harmonics.h"
#include "unity.h"
#include "worst.h"

static const double turn = 4294967296.0; /* counts per turn */
static const double two_pi = 6.283185307179586476925;
static const double degree = 4294967296.0 / 360.0; /* mechanical */

static angle_harmonics_config_t config;
static angle_harmonics_state_t state;
static int32_t table[ANGLE_HARMONICS_PARTS];
static double theta; /* true, in turns */

void setUp(void)
{
    config = (angle_harmonics_config_t){(int32_t)(2.0 / 3.0 * degree)};
    state = (angle_harmonics_state_t){0};
    memset(table, 0, sizeof table);
    theta = 0.123;
}

void tearDown(void)
{
}

static uint32_t counts(double turns)
{
    return (uint32_t)(int64_t)llround((turns - floor(turns)) * turn);
}

/* Error of a sensor with harmonics of 0.3 degrees once and 0.25 degrees twice per turn, in turns. With three pole pairs
 * each is nearly one electrical degree. */
static double sensor_error(double at)
{
    return (0.3 * cos(two_pi * at - 1.0) + 0.25 * sin(2.0 * two_pi * at + 0.4)) / 360.0;
}

/* Steps of 1 ms as in the drive: each sample is corrected with the table and then used for adaptation. Returns the
 * largest remaining error of the last 100 steps, in degrees. */
static double drive(double rpm, double rpm_per_s, int steps)
{
    double worst = 0.0;
    for (int k = 0; k < steps; k++) {
        theta += (rpm + rpm_per_s * k * 1e-3) / 60e3;
        const uint32_t read = counts(theta + sensor_error(theta));
        const uint32_t corrected = read + (uint32_t)table[read >> ANGLE_HARMONICS_SHIFT];
        if (k >= steps - 100) {
            worst = worse_of(worst, fabs((double)(int32_t)(corrected - counts(theta)) / degree));
        }
        angle_harmonics_step(&config, &state, corrected, table);
    }
    return worst;
}

/* After five of the longer time constants (AT-13) 0.7 % of 0.3 degrees remain. The table without interpolation has an
 * error of half a part: (0.3 + 2 * 0.25) pi/64 = 0.04 degrees. */
void test_the_first_two_harmonics_of_the_sensor_are_removed_in_both_directions(void)
{
    TEST_ASSERT_TRUE(drive(8400.0, 0.0, 200) > 0.05);
    TEST_ASSERT_TRUE(drive(8400.0, 0.0, 900) < 0.05);
    setUp();
    TEST_ASSERT_TRUE(drive(-5000.0, 0.0, 2500) < 0.05);
}

void test_acceleration_is_not_taken_for_a_harmonic(void)
{
    TEST_ASSERT_TRUE(drive(3000.0, 6000.0, 1000) < 0.06);
}

/* By (AT-13), adaptation for 10 s at 900 rpm would remove nine tenths of the second harmonic. */
void test_below_940_rpm_the_coefficients_are_kept(void)
{
    (void)drive(900.0, 0.0, 10000);
    TEST_ASSERT_EQUAL_INT32(0, state.c[0] | state.c[1] | state.c[2] | state.c[3]);
    (void)drive(8000.0, 0.0, 1000);
    const angle_harmonics_state_t before = state;
    (void)drive(500.0, 0.0, 1000);
    (void)drive(0.0, 0.0, 1000);
    TEST_ASSERT_EQUAL_INT32(before.c[0], state.c[0]);
    TEST_ASSERT_EQUAL_INT32(before.c[3], state.c[3]);
    TEST_ASSERT_TRUE(drive(500.0, 0.0, 200) < 0.05);
}

/* Every seventh sample is taken one period late, which is a tenth of the step: used, a single one would change a
 * coefficient by up to 7e5 LSB. What remains is the resolution of the mean second difference, 2048 LSB. */
void test_late_samples_are_not_used_for_adaptation(void)
{
    for (int k = 0; k < 4000; k++) {
        theta += 6000.0 / 60e3;
        angle_harmonics_step(&config, &state, counts(theta + ((k % 7 == 0) ? 600.0 / 60e3 : 0.0)), table);
    }
    TEST_ASSERT_INT32_WITHIN(256, 0, state.c[0]);
    TEST_ASSERT_INT32_WITHIN(256, 0, state.c[3]);
}

void test_the_coefficients_stay_within_their_limit(void)
{
    for (int k = 0; k < 5000; k++) {
        theta += 7000.0 / 60e3;
        angle_harmonics_step(&config, &state, counts(theta - 0.002 * cos(two_pi * theta)), table); /* uncorrected */
    }
    TEST_ASSERT_EQUAL_INT32(config.max, state.c[0]);
}

/* Largest deviation of a coefficient from the sensor's error, in degrees. */
static double deviation(void)
{
    const double right[4] = {-0.3 * cos(1.0), -0.3 * sin(1.0), -0.25 * sin(0.4), -0.25 * cos(0.4)};
    double worst = 0.0;
    for (int n = 0; n < 4; n++) {
        worst = worse_of(worst, fabs(state.c[n] / degree - right[n]));
    }
    return worst;
}

/* 0.17 degrees; with mu = 1/64 at every speed 0.32 degrees would be left. */
void test_a_rotor_that_speeds_up_fast_is_corrected_before_it_is_fast(void)
{
    (void)drive(2000.0, 40000.0, 113);
    TEST_ASSERT_TRUE(drive(6520.0, 0.0, 100) < 0.25);
}

/* 0.021 degrees; without (AT-20) the coefficients of a corrected sensor would change by 0.034 degrees. */
void test_acceleration_changes_the_coefficients_only_at_its_beginning(void)
{
    double worst = 0.0;
    (void)drive(4000.0, 0.0, 5000);
    for (int k = 0; k < 150; k++) {
        (void)drive(4000.0 + 20.0 * k, 0.0, 1);
        worst = (k > 30) ? worse_of(worst, deviation()) : 0.0;
    }
    TEST_ASSERT_TRUE(worst < 0.027);
}

/* The correction acts through a table that is renewed in 16 steps. With mu = 1/16 a 16th of the second harmonic is
 * corrected in a step just below 1/8 turn per step, which is damped; with mu = 1/4 it would grow. */
void test_the_faster_correction_is_damped(void)
{
    (void)drive(7490.0, 0.0, 300);
    for (int k = 0; k < 100; k++) {
        (void)drive(7490.0, 0.0, 1);
        TEST_ASSERT_TRUE(deviation() < 0.04);
    }
}

/* Uncorrected samples through (AT-20), (AT-11) and (AT-12) in double precision, at a speed of the larger gain. The
 * fixed point rounds each step by up to 1/2 LSB and sine and cosine to 2^-15: 100 steps of up to 5e5 LSB of d/16 have
 * an error of 16 LSB each. */
/* No value is older than 16 steps: the mean age of 8.5 steps is the delay for which (AT-11) has its gain. */
void test_a_step_renews_four_parts_a_quarter_of_a_turn_apart(void)
{
    for (unsigned step = 0; step < 16U; step++) {
        for (unsigned part = 0; part < ANGLE_HARMONICS_PARTS; part++) {
            table[part] = 12345;
        }
        angle_harmonics_step(&config, &state, 0, table);
        for (unsigned part = 0; part < ANGLE_HARMONICS_PARTS; part++) {
            TEST_ASSERT_EQUAL_INT32((part % 16U == step) ? 0 : 12345, table[part]);
        }
    }
}

/* The place in the table has no seal: a value that the memory has changed must not lead behind the table. */
void test_a_damaged_place_stays_in_the_table(void)
{
    int32_t around[ANGLE_HARMONICS_PARTS + 256];
    for (unsigned n = 0; n < sizeof around / sizeof around[0]; n++) {
        around[n] = 12345;
    }
    for (unsigned part = 0; part < 256U; part++) {
        angle_harmonics_state_t damaged = {.part = (uint8_t)part};
        angle_harmonics_step(&config, &damaged, 0, around);
    }
    for (unsigned n = ANGLE_HARMONICS_PARTS; n < sizeof around / sizeof around[0]; n++) {
        TEST_ASSERT_EQUAL_INT32(12345, around[n]);
    }
}

void test_coefficients_and_table_match_their_equations(void)
{
    double c[4] = {0}, last = 0.0, before = 0.0, acceleration = 0.0;
    config.max = 0x00FFFFFF;
    for (int k = 0; k < 100; k++) {
        theta += 6500.0 / 60e3;
        const double at = theta + sensor_error(theta);
        const double d = (at - 2.0 * last + before) * turn;
        if (k > 1) {
            const double w = two_pi * last;
            const double wave[4] = {cos(w), sin(w), cos(2.0 * w), sin(2.0 * w)};
            for (int n = 0; n < 4; n++) {
                c[n] += (d - acceleration) * wave[n] / 16.0;
            }
            acceleration += (d - acceleration) / 16.0;
        }
        before = last;
        last = at;
        angle_harmonics_step(&config, &state, counts(at), table);
    }
    TEST_ASSERT_DOUBLE_WITHIN(1600.0, c[0], state.c[0]);
    TEST_ASSERT_DOUBLE_WITHIN(1600.0, c[1], state.c[1]);
    TEST_ASSERT_DOUBLE_WITHIN(1600.0, c[2], state.c[2]);
    TEST_ASSERT_DOUBLE_WITHIN(1600.0, c[3], state.c[3]);
    state.c[0] = 3000000;
    state.c[3] = -2000000;
    state.c[1] = state.c[2] = 0;
    for (int k = 0; k < 16; k++) { /* at standstill the table is only computed again */
        angle_harmonics_step(&config, &state, state.last, table);
    }
    for (int j = 0; j < ANGLE_HARMONICS_PARTS; j++) {
        const double w = two_pi * (j + 0.5) / 64.0;
        TEST_ASSERT_DOUBLE_WITHIN(200.0, 3e6 * cos(w) - 2e6 * sin(2.0 * w), table[j]);
    }
}
