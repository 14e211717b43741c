/* SPDX-License-Identifier: Apache-2.0 */
#include "safety/monitor.h"
#include "unity.h"

static const monitor_config_t config = {
    .i_trip = 25000, .v_max = 28000, .v_min = 10000, .sum_max = 900, .zero_max = 300};
static monitor_state_t state;
static monitor_in_t in;
static bool jumped;

void setUp(void)
{
    state = (monitor_state_t){0};
    jumped = false;
    in = (monitor_in_t){.v_dc = 20000};
}

void tearDown(void)
{
}

static uint32_t step(void)
{
    if (jumped) {
        monitor_report_angle_jump(&state);
    }
    return monitor_step(&config, &state, &in);
}

/* The fault appears in the sample `samples` and not before, and goes with the first good one. */
static void confirmed_after(int samples, uint32_t fault, monitor_in_t bad)
{
    const monitor_in_t good = in;
    for (int round = 0; round < 2; round++) {
        in = bad;
        for (int n = 1; n < samples; n++) {
            TEST_ASSERT_EQUAL_HEX32(0, step());
        }
        TEST_ASSERT_EQUAL_HEX32(fault, step());
        for (int n = 0; n < 1000; n++) { /* long enough for an 8-bit count to wrap */
            TEST_ASSERT_EQUAL_HEX32(fault, step());
        }
        in = good;
        TEST_ASSERT_EQUAL_HEX32(0, step());
    }
    for (int n = 0; n < 100; n++) { /* never that many in a row */
        in = (n % samples == samples - 1) ? good : bad;
        TEST_ASSERT_EQUAL_HEX32(0, step());
    }
}

void test_good_samples_raise_nothing(void)
{
    in.i = (abc_q15_t){25000, -12500, -12500};
    TEST_ASSERT_EQUAL_HEX32(0, step());
}

void test_one_sample_above_the_trip_current_of_any_phase_and_sign_is_an_over_current(void)
{
    for (int phase = 0; phase < 3; phase++) {
        for (int sign = -1; sign <= 1; sign += 2) {
            const q15_t high = (q15_t)(sign * 25001);
            const q15_t half = (q15_t)(-high / 2);
            in.i = (abc_q15_t){(phase == 0) ? high : half, (phase == 1) ? high : half, (phase == 2) ? high : half};
            TEST_ASSERT_EQUAL_HEX32(FAULT_OVER_CURRENT, step());
        }
    }
    in.i = (abc_q15_t){-25000, 12500, 12500};
    TEST_ASSERT_EQUAL_HEX32(0, step());
}

/* -1 has no positive counterpart: a negation that wraps would hide the largest current there is. */
void test_the_lower_end_stop_of_the_converter_is_an_over_current(void)
{
    in.i = (abc_q15_t){INT16_MIN, 16384, 16384};
    TEST_ASSERT_EQUAL_HEX32(FAULT_OVER_CURRENT, step());
}

void test_over_voltage_needs_two_samples_in_a_row(void)
{
    monitor_in_t bad = in;
    bad.v_dc = 28001;
    confirmed_after(2, FAULT_OVER_VOLTAGE, bad);
    in.v_dc = 28000;
    TEST_ASSERT_EQUAL_HEX32(0, step() | step() | step());
}

void test_under_voltage_needs_ten_samples_in_a_row(void)
{
    monitor_in_t bad = in;
    bad.v_dc = 9999;
    confirmed_after(10, FAULT_UNDER_VOLTAGE, bad);
    in.v_dc = 10000;
    for (int n = 0; n < 20; n++) {
        TEST_ASSERT_EQUAL_HEX32(0, step());
    }
}

void test_a_current_sum_needs_five_samples_in_a_row_with_either_sign(void)
{
    monitor_in_t bad = in;
    bad.i = (abc_q15_t){301, 300, 300};
    confirmed_after(5, FAULT_CURRENT_SUM, bad);
    setUp();
    bad.i = (abc_q15_t){-301, -300, -300};
    confirmed_after(5, FAULT_CURRENT_SUM, bad);
    in.i = (abc_q15_t){300, 300, 300};
    for (int n = 0; n < 20; n++) {
        TEST_ASSERT_EQUAL_HEX32(0, step());
    }
}

void test_three_angle_jumps_in_a_row_are_an_angle_fault(void)
{
    for (int round = 0; round < 2; round++) {
        jumped = true;
        TEST_ASSERT_EQUAL_HEX32(0, step());
        TEST_ASSERT_EQUAL_HEX32(0, step());
        TEST_ASSERT_EQUAL_HEX32(FAULT_ANGLE, step());
        TEST_ASSERT_EQUAL_HEX32(FAULT_ANGLE, step());
        jumped = false;
        TEST_ASSERT_EQUAL_HEX32(0, step());
    }
    for (int n = 0; n < 100; n++) { /* never three in a row */
        jumped = n % 3 != 0;
        TEST_ASSERT_EQUAL_HEX32(0, step());
    }
}

/* A jump is noted for one period: after a good one nothing counts any more. */
void test_a_jump_is_evaluated_once_and_then_cleared(void)
{
    TEST_ASSERT_EQUAL(0, state.pending);
    monitor_report_angle_jump(&state);
    TEST_ASSERT_EQUAL(MONITOR_ANGLE_JUMP, state.pending);
    (void)step(); /* counts one */
    TEST_ASSERT_EQUAL(MONITOR_COUNTING, state.pending);
    (void)step(); /* a good one: counts no longer */
    TEST_ASSERT_EQUAL(0, state.pending);
}

void test_several_faults_are_reported_together(void)
{
    in.i = (abc_q15_t){32767, 32767, 32767};
    in.v_dc = 32767;
    jumped = true;
    uint32_t faults = 0;
    for (int n = 0; n < 5; n++) {
        faults = step();
    }
    TEST_ASSERT_EQUAL_HEX32(FAULT_OVER_CURRENT | FAULT_OVER_VOLTAGE | FAULT_CURRENT_SUM | FAULT_ANGLE, faults);
}
