/* SPDX-License-Identifier: Apache-2.0 */
#include "safety/monitor.h"
#include "unity.h"

static const monitor_config_t config = {
    .i_trip = 25000, .v_max = 28000, .v_min = 10000, .sum_max = 900, .zero_sequence_max = 300, .angle_count_max = 300};
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

/* The fault appears with this number of bad samples in a row and not before, and ends with the first good one. */
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
    for (int n = 0; n < 100; n++) { /* always one bad sample in a row too few */
        in = (n % samples == samples - 1) ? good : bad;
        TEST_ASSERT_EQUAL_HEX32(0, step());
    }
}

/* Each limit alone; the current by its magnitude, the sum by its third, in steps of 2^-13 of its format. */
void test_a_sample_is_normal_only_inside_every_limit(void)
{
    monitor_config_t c = config;
    c.i_normal_squared_q30 = 10000 * 10000;
    const fx_pair_t below = fx_pair(9999, 0);
    const fx_pair_t beyond = fx_pair(0, -10000);
    const int32_t sum = (c.zero_sequence_max - 1) * 8192;
    TEST_ASSERT_TRUE(monitor_is_sample_normal(&c, below, sum, c.v_min));
    TEST_ASSERT_TRUE(monitor_is_sample_normal(&c, below, -sum, c.v_max));
    TEST_ASSERT_FALSE(monitor_is_sample_normal(&c, beyond, 0, c.v_min));
    TEST_ASSERT_FALSE(monitor_is_sample_normal(&c, below, c.zero_sequence_max * 8192, c.v_min));
    TEST_ASSERT_FALSE(monitor_is_sample_normal(&c, below, -(c.zero_sequence_max + 1) * 8192, c.v_min));
    TEST_ASSERT_FALSE(monitor_is_sample_normal(&c, below, 0, c.v_min - 1));
    TEST_ASSERT_FALSE(monitor_is_sample_normal(&c, below, 0, c.v_max + 1));
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

/* -1 has no positive counterpart: a negation that wraps would hide the largest current. */
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

void test_an_over_voltage_is_expected_if_the_last_two_samples_led_to_it_by_a_straight_line(void)
{
    TEST_ASSERT_TRUE(monitor_is_over_voltage_expected(&config, 28001, 27000, 25999));
    TEST_ASSERT_FALSE(monitor_is_over_voltage_expected(&config, 28001, 27000, 26000)); /* just to the limit */
    TEST_ASSERT_FALSE(monitor_is_over_voltage_expected(&config, 28000, 27000, 25999));
    TEST_ASSERT_FALSE(monitor_is_over_voltage_expected(&config, 28001, 26000, 27000)); /* a spike after a fall */
}

/* A sixth of 28000 is 4666.7. Below v_min: an empty link, or no sample yet. */
void test_a_dc_voltage_that_rises_faster_than_a_link_can_is_of_a_wrong_sensor(void)
{
    TEST_ASSERT_TRUE(monitor_is_rise_of_sensor(&config, 29667, 25000));
    TEST_ASSERT_FALSE(monitor_is_rise_of_sensor(&config, 29666, 25000));
    TEST_ASSERT_FALSE(monitor_is_rise_of_sensor(&config, 25000, 29667));
    TEST_ASSERT_TRUE(monitor_is_rise_of_sensor(&config, 30000, 10000));
    TEST_ASSERT_FALSE(monitor_is_rise_of_sensor(&config, 30000, 9999));
    const monitor_config_t even = {.v_max = 28002};
    TEST_ASSERT_FALSE(monitor_is_rise_of_sensor(&even, 29667, 25000)); /* just a sixth */
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

/* The count rises by 40 with the first sample and by 4 with each further one: it reaches 300 with the 66th. */
void test_an_angle_that_stays_implausible_for_66_samples_is_a_fault(void)
{
    for (int round = 0; round < 2; round++) {
        jumped = true;
        for (int n = 1; n < 66; n++) {
            TEST_ASSERT_EQUAL_HEX32(0, step());
        }
        TEST_ASSERT_EQUAL_HEX32(FAULT_ANGLE, step());
        TEST_ASSERT_EQUAL_HEX32(FAULT_ANGLE, step());
        jumped = false;
        for (int n = 0; n < 300; n++) { /* until the count is zero again */
            TEST_ASSERT_EQUAL(MONITOR_COUNTING, state.pending & MONITOR_COUNTING);
            TEST_ASSERT_EQUAL_HEX32(0, step());
        }
        TEST_ASSERT_EQUAL(0, state.pending);
    }
}

/* In every group of `every` samples the first `bad` ones are bad. Returns the sample with the fault; 0: none. */
static int faulted_after(int every, int bad, int samples)
{
    state = (monitor_state_t){0};
    for (int n = 0; n < samples; n++) {
        jumped = n % every < bad;
        if (step() == FAULT_ANGLE) {
            return n + 1;
        }
    }
    return 0;
}

/* The count rises by 31 in each ten samples, with 40 at the first of them: it reaches 300 in the tenth group. */
void test_single_spikes_are_a_fault_if_they_are_frequent_and_tolerated_if_they_are_rare(void)
{
    TEST_ASSERT_EQUAL_INT(91, faulted_after(10, 1, 1000));
    TEST_ASSERT_EQUAL_INT(7 * 2 + 1, faulted_after(2, 1, 1000)); /* 39 in each two */
    TEST_ASSERT_EQUAL_INT(0, faulted_after(41, 1, 1000000));     /* 40 up, 40 down */
    TEST_ASSERT_GREATER_THAN(0, faulted_after(39, 1, 1000000));
}

void test_a_glitch_of_50_samples_every_286_is_tolerated(void)
{
    TEST_ASSERT_EQUAL_INT(0, faulted_after(50 + 236, 50, 1000000));
    TEST_ASSERT_EQUAL_INT(66, faulted_after(1000, 66, 1000));
}

/* A reported jump is evaluated in one period only; a good period after it lowers the count. */
void test_a_jump_is_evaluated_once_and_then_cleared(void)
{
    TEST_ASSERT_EQUAL(0, state.pending);
    monitor_report_angle_jump(&state);
    TEST_ASSERT_EQUAL(MONITOR_ANGLE_JUMP, state.pending);
    (void)step(); /* counts the jump */
    TEST_ASSERT_EQUAL(MONITOR_COUNTING | MONITOR_ANGLE_LOST, state.pending);
    (void)step(); /* a good period */
    TEST_ASSERT_EQUAL(MONITOR_COUNTING, state.pending);
    TEST_ASSERT_EQUAL(39, state.angle);
}

void test_several_faults_are_reported_together(void)
{
    in.i = (abc_q15_t){32767, 32767, 32767};
    in.v_dc = 32767;
    jumped = true;
    uint32_t faults = 0;
    for (int n = 0; n < 66; n++) {
        faults = step();
    }
    TEST_ASSERT_EQUAL_HEX32(FAULT_OVER_CURRENT | FAULT_OVER_VOLTAGE | FAULT_CURRENT_SUM | FAULT_ANGLE, faults);
}
