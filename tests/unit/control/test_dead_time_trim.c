/* SPDX-License-Identifier: Apache-2.0 */
#include "control/adapt/dead_time_trim.h"

#include <math.h>

#include "twin/twin_trim.h"
#include "unity.h"

#define SIGMA 0.0027 /* hsm1: 1.45 V of 540 V */
#define V_DC 0.648   /* 350 V */
#define BASE 749     /* 8 V of 350 V */
#define ONE_Q30 (1 << 30)
#define VARIANCE_Q30 (ONE_Q30 / 8) /* small enough to be used */
#define PI 3.14159265358979324

static dead_time_trim_state_t state;

void setUp(void)
{
    state = (dead_time_trim_state_t){.base = BASE};
}

void tearDown(void)
{
}

static int32_t q27(double x)
{
    return (int32_t)lround(x * 134217728.0);
}

static dead_time_trim_in_t input(double x)
{
    return (dead_time_trim_in_t){
        .sigma = Q31(SIGMA),
        .x_q27 = q27(x),
        .variance_q30 = VARIANCE_Q30,
        .v_dc = (q15_t)lround(V_DC * 32768.0),
        .dead_time = (q15_t)(state.base + state.trim),
        .identifying = true,
        .period_steps = 1000,
    };
}

/* A run_one_second of steps; returns the result of the last one. */
static dead_time_trim_t run_one_second(const dead_time_trim_in_t *in)
{
    dead_time_trim_t out = {in->dead_time, 0};
    for (int ms = 0; ms < 1000; ms++) {
        TEST_ASSERT_EQUAL_INT(in->dead_time, out.dead_time);
        TEST_ASSERT_EQUAL_INT32(0, out.x_shift_q27);
        out = dead_time_trim_step(&state, in);
    }
    return out;
}

void test_a_sixteenth_of_the_remaining_error_is_added_each_second(void)
{
    /* pi/4 * 0.0027 / 0.648 = 0.0032725: 107.2 LSB; 107/16 = 6.7 is rounded away from zero. */
    const dead_time_trim_in_t more = input(1.0);
    TEST_ASSERT_EQUAL_INT(BASE + 7, run_one_second(&more).dead_time);
    setUp();
    const dead_time_trim_in_t less = input(-1.0);
    TEST_ASSERT_EQUAL_INT(BASE - 7, run_one_second(&less).dead_time);
}

/* The fundamental along the current is 4/pi of a leg's error. The sum of drop and compensation does not change. */
void test_the_identified_drop_is_reduced_by_what_is_added_to_the_compensation(void)
{
    for (double x = -3.9; x < 4.0; x += 0.13) {
        for (double v_dc = 0.3; v_dc < 1.0; v_dc += 0.11) {
            setUp();
            dead_time_trim_in_t in = input(x);
            in.v_dc = (q15_t)lround(v_dc * 32768.0);
            const dead_time_trim_t out = run_one_second(&in);
            const double added = 4.0 / PI * (in.v_dc / 32768.0) * (out.dead_time - BASE) / 32768.0;
            TEST_ASSERT_DOUBLE_WITHIN(2e-9, -added, SIGMA * out.x_shift_q27 / 134217728.0);
        }
    }
}

/* The twin does not round. The steps are rounded away from zero, each by up to 15/16 LSB; once the trim is 15 LSB ahead
 * of the twin, its next step is 15/16 LSB smaller, so that the difference does not grow beyond that. */
void test_over_five_minutes_the_trim_follows_the_twin(void)
{
    for (double x = -1.6; x < 1.7; x += 0.4) {
        setUp();
        twin_trim_t twin = {BASE / 32768.0, 0.0};
        double drop = SIGMA * x;
        dead_time_trim_in_t in = input(x);
        for (int s = 0; s < 300; s++) {
            const dead_time_trim_t out = run_one_second(&in);
            in.dead_time = out.dead_time;
            in.x_q27 += out.x_shift_q27;
            drop = twin_trim(&twin, drop, in.v_dc / 32768.0);
            TEST_ASSERT_DOUBLE_WITHIN(15.0, twin.trim * 32768.0, state.trim);
        }
        /* The remaining drop is less than one LSB of the duty. */
        TEST_ASSERT_DOUBLE_WITHIN(4.0 / PI * V_DC / 32768.0, 0.0, SIGMA * in.x_q27 / 134217728.0);
        TEST_ASSERT_DOUBLE_WITHIN(1.0, twin.trim * 32768.0, state.trim);
    }
}

void test_the_trim_is_limited_to_a_quarter_of_the_base_and_the_rest_stays_in_the_identified_drop(void)
{
    dead_time_trim_in_t in = input(4.0);
    for (int s = 0; s < 100; s++) {
        const dead_time_trim_t out = run_one_second(&in);
        in.dead_time = out.dead_time;
        in.x_q27 += out.x_shift_q27;
    }
    TEST_ASSERT_EQUAL_INT(BASE + BASE / 4, in.dead_time);
    /* 4 sigma are 429 LSB, of which 187 are transferred. */
    TEST_ASSERT_DOUBLE_WITHIN(0.01, 4.0 * (1.0 - 187.0 / 429.0), in.x_q27 / 134217728.0);
    in.x_q27 = q27(-4.0);
    for (int s = 0; s < 100; s++) {
        in.dead_time = run_one_second(&in).dead_time;
    }
    TEST_ASSERT_EQUAL_INT(BASE - BASE / 4, in.dead_time);
}

void test_with_an_uncertain_drop_or_without_dc_voltage_nothing_changes(void)
{
    dead_time_trim_in_t in = input(2.0);
    in.variance_q30 = ONE_Q30 / 4 + 1;
    TEST_ASSERT_EQUAL_INT(BASE, run_one_second(&in).dead_time);
    in = input(2.0);
    in.v_dc = 0;
    TEST_ASSERT_EQUAL_INT(BASE, run_one_second(&in).dead_time);
}

void test_only_steps_with_identification_are_counted(void)
{
    dead_time_trim_in_t in = input(2.0);
    for (int ms = 0; ms < 999; ms++) {
        TEST_ASSERT_EQUAL_INT(BASE, dead_time_trim_step(&state, &in).dead_time);
    }
    in.identifying = false;
    TEST_ASSERT_EQUAL_INT(BASE, run_one_second(&in).dead_time);
    in.identifying = true;
    TEST_ASSERT_NOT_EQUAL(BASE, dead_time_trim_step(&state, &in).dead_time);
}

void test_a_dead_time_set_from_outside_is_the_new_base(void)
{
    dead_time_trim_in_t in = input(4.0);
    in.dead_time = run_one_second(&in).dead_time;
    in.dead_time = 400;
    TEST_ASSERT_EQUAL_INT(400, dead_time_trim_step(&state, &in).dead_time);
    TEST_ASSERT_EQUAL_INT32(400, state.base);
    TEST_ASSERT_EQUAL_INT32(0, state.trim);
}

/* The compensation has been switched off. */
void test_a_compensation_of_zero_stays_zero(void)
{
    state = (dead_time_trim_state_t){0};
    const dead_time_trim_in_t in = input(4.0);
    TEST_ASSERT_EQUAL_INT(0, run_one_second(&in).dead_time);
}

void test_a_stored_trim_replaces_the_present_one_within_its_limits(void)
{
    TEST_ASSERT_EQUAL_INT(BASE + 100, dead_time_trim_restore(&state, BASE, 100));
    TEST_ASSERT_EQUAL_INT(BASE - 50, dead_time_trim_restore(&state, BASE + 100, -50));
    TEST_ASSERT_EQUAL_INT(BASE + 187, dead_time_trim_restore(&state, BASE - 50, 5000));
    TEST_ASSERT_EQUAL_INT(400, dead_time_trim_restore(&state, 400, 0)); /* set from outside */
    TEST_ASSERT_EQUAL_INT32(400, state.base);
}
