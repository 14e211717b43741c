/* SPDX-License-Identifier: Apache-2.0 */
/* The voltage pulses on a machine of two inductances, one of which saturates; the voltage acts one period later. */
#include <math.h>
#include <unity.h>

#include "drive/pulses.h"

#define TOP 20000   /* q15 */
#define PERIODS 400 /* longer than every sequence here */

static pulses_config_t config;
static pulses_state_t state;
static double i_d, i_q, largest_d, largest_q, impulse;
static dq_q15_t acting;
static uint32_t theta;

void setUp(void)
{
    config = (pulses_config_t){
        .d = {.v = 8000, .low = -TOP, .high = TOP},
        .q = {.v = 0, .low = -TOP, .high = TOP},
        .first = 23170,
        .angle_max = 1000000,
        .square_max = 21000U * 21000U,
        .reversals = 4,
        .periods_max = PERIODS,
        .number = (uint16_t)(state.number + 1U),
    };
    i_d = i_q = largest_d = largest_q = impulse = 0.0;
    acting = (dq_q15_t){0, 0};
    theta = 5;
}

void tearDown(void)
{
}

/* Saturation: the current changes up to three times as fast at TOP. */
static double change(double v, double i)
{
    return 0.1 * v * (1.0 + 2.0 * (i / TOP) * (i / TOP)) - 0.001 * i;
}

static void period(void)
{
    const dq_q15_t sample = {(int32_t)lrint(i_d), (int32_t)lrint(i_q)};
    const dq_q15_t next = pulses_step(&config, &state, sample, theta);
    i_d += change(acting.d, i_d);
    i_q += change(acting.q, i_q);
    acting = next;
    largest_d = fmax(largest_d, fabs(i_d));
    largest_q = fmax(largest_q, fabs(i_q));
    impulse += i_q;
}

static void periods(int count)
{
    for (int n = 0; n < count; n++) {
        period();
    }
}

static void assert_ended(pulses_failure_t failure)
{
    TEST_ASSERT_FALSE(pulses_active(&state));
    TEST_ASSERT_EQUAL_INT(failure == PULSES_GOOD ? PULSES_DONE : PULSES_FAILED, state.phase);
    TEST_ASSERT_EQUAL_INT(failure, state.failure);
    TEST_ASSERT_DOUBLE_WITHIN(0.01 * TOP, 0.0, i_d);
    TEST_ASSERT_DOUBLE_WITHIN(0.01 * TOP, 0.0, i_q);
}

void test_the_current_stays_within_its_bounds_and_ends_at_zero(void)
{
    periods(PERIODS);
    assert_ended(PULSES_GOOD);
    TEST_ASSERT_EQUAL_UINT16(4, state.reversals);
    TEST_ASSERT_TRUE(largest_d > 0.8 * TOP && largest_d < 1.03 * TOP);
    TEST_ASSERT_TRUE(largest_q == 0.0);
}

/* Up to steps of 12 % at the bound, which the tool chooses; where the last one ends depends on the voltage. */
void test_growing_changes_are_foreseen(void)
{
    for (int32_t v = 3000; v <= 8000; v += 250) {
        setUp();
        config.d.v = v;
        periods(PERIODS);
        assert_ended(PULSES_GOOD);
        TEST_ASSERT_TRUE(largest_d < 1.01 * TOP);
    }
}

void test_a_bias_of_d_is_held_while_q_alternates(void)
{
    config.d = (pulses_axis_config_t){.v = 4000, .low = -12000, .high = -8000};
    config.q.v = 8000;
    config.q.high = 15000;
    config.q.low = -15000;
    config.delay = 60;
    periods(60);
    TEST_ASSERT_TRUE(largest_q == 0.0);
    for (int n = 0; state.phase == PULSES_PULSE && n < PERIODS; n++) {
        TEST_ASSERT_DOUBLE_WITHIN(2500.0, -10000.0, i_d);
        period();
    }
    periods(60);
    assert_ended(PULSES_GOOD);
    TEST_ASSERT_TRUE(largest_q > 12000.0 && largest_q < 15500.0);
}

/* One half wave alone would leave some 10 TOP. */
void test_the_impulse_of_q_is_balanced(void)
{
    config.d.v = 0;
    config.q.v = 4000;
    config.reversals = 5;
    periods(PERIODS);
    assert_ended(PULSES_GOOD);
    TEST_ASSERT_DOUBLE_WITHIN(2.0 * TOP, 0.0, impulse);
}

void test_a_movement_ends_them(void)
{
    periods(10);
    theta += 1000002U;
    periods(60);
    assert_ended(PULSES_MOVED);
}

void test_a_movement_backwards_ends_them(void)
{
    periods(10);
    theta -= 1000002U;
    periods(60);
    assert_ended(PULSES_MOVED);
}

void test_a_small_movement_does_not_end_them(void)
{
    periods(10);
    theta -= 10U;
    periods(PERIODS);
    assert_ended(PULSES_GOOD);
}

void test_the_time_ends_them(void)
{
    config.periods_max = 12;
    periods(80);
    assert_ended(PULSES_TIME);
    TEST_ASSERT_EQUAL_UINT16(13, state.periods);
}

void test_too_large_a_current_ends_them(void)
{
    config.square_max = 9000U * 9000U;
    periods(80);
    assert_ended(PULSES_CURRENT);
    TEST_ASSERT_TRUE(largest_d < 12000.0);
}

void test_a_number_is_carried_out_once(void)
{
    periods(PERIODS);
    assert_ended(PULSES_GOOD);
    largest_d = 0.0;
    periods(50);
    TEST_ASSERT_TRUE(largest_d < 0.03 * TOP);
}

/* The first half wave ends at its share of the bound, 14 142; nothing has to be balanced yet. */
void test_a_single_reversal_of_q_ends_at_the_share_of_the_bound(void)
{
    config.d.v = 0;
    config.q.v = 4000;
    config.reversals = 1;
    periods(PERIODS);
    assert_ended(PULSES_GOOD);
    TEST_ASSERT_TRUE(largest_q > 13000.0 && largest_q < 14800.0);
}

/* The second half wave is too small to balance the first: the last one would have to be negative, too, and ends as soon
 * as the current is positive, which the two periods from the sample to the voltage delay. */
void test_a_last_half_wave_that_cannot_balance_the_others_ends_at_once(void)
{
    config.d.v = 0;
    config.q = (pulses_axis_config_t){.v = 4000, .low = -2000, .high = TOP};
    config.reversals = 3;
    while (state.number != config.number || state.reversals < 2U) {
        period();
    }
    largest_q = 0.0;
    periods(PERIODS);
    assert_ended(PULSES_GOOD);
    TEST_ASSERT_TRUE(largest_q < 2500.0);
}

/* It has no current, and the voltage of one period changes that by a tenth of it. */
void test_an_axis_that_has_not_begun_gets_the_voltage_of_one_period_at_most_on_the_way_back(void)
{
    config.q.v = 4000;
    config.delay = 60;
    periods(10);
    theta += 1000002U;
    period();
    for (int n = 0; n < 60; n++) {
        period();
        TEST_ASSERT_EQUAL_INT32(0, acting.q);
    }
    TEST_ASSERT_EQUAL_INT(PULSES_FAILED, state.phase);
    TEST_ASSERT_EQUAL_INT(PULSES_MOVED, state.failure);
    TEST_ASSERT_TRUE(largest_q < 401.0);
}

/* 0.6 of the dc voltage is the largest one: 0.5 and -0.25 of it at half of the voltage base are 0.15 and -0.075. */
void test_the_voltage_of_the_pulses_is_their_share_of_the_largest_one(void)
{
    const current_control_out_t out = pulses_voltage((dq_q15_t){16384, -8192}, Q31(0.6), 16384);
    TEST_ASSERT_INT32_WITHIN(1, 4915, out.u.d);
    TEST_ASSERT_INT32_WITHIN(1, -2458, out.u.q);
    TEST_ASSERT_EQUAL_HEX32(fx_pair(16384, -8192), out.v);
    TEST_ASSERT_FALSE(out.clear);
    TEST_ASSERT_EQUAL_UINT32(0, out.limited);
}
