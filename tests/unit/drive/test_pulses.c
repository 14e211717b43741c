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

/* Steps with given currents, in place of the machine. */
static void gives(int32_t i_d_lsb, int32_t i_q_lsb, int32_t v_d, int32_t v_q)
{
    const dq_q15_t v = pulses_step(&config, &state, (dq_q15_t){i_d_lsb, i_q_lsb}, theta);
    TEST_ASSERT_EQUAL_INT32(v_d, v.d);
    TEST_ASSERT_EQUAL_INT32(v_q, v.q);
}

static void alternate_q(uint16_t reversals)
{
    config.d.v = 0;
    config.q = (pulses_axis_config_t){.v = 4000, .low = -100, .high = 100};
    config.first = Q15(1.0);
    config.reversals = reversals;
}

void test_the_first_direction_is_towards_the_bound_that_is_further_from_zero(void)
{
    config.d = (pulses_axis_config_t){.v = 4000, .low = -12000, .high = -8000};
    config.q = (pulses_axis_config_t){.v = 3000, .low = -8000, .high = 8000};
    gives(0, 0, -4000, 3000);
}

/* The current does not change, so that nothing is added to it. */
void test_the_voltage_reverses_at_the_bound_and_not_a_step_earlier(void)
{
    config.d = (pulses_axis_config_t){.v = 4000, .low = -50, .high = 100};
    gives(99, 0, 4000, 0);
    gives(99, 0, 4000, 0);
    gives(99, 0, 4000, 0);
    gives(100, 0, -4000, 0);
    setUp();
    config.d = (pulses_axis_config_t){.v = 4000, .low = -50, .high = 100};
    gives(100, 0, 4000, 0);
    gives(100, 0, -4000, 0);
    gives(-49, 0, -4000, 0); /* 149 against the voltage that acts */
    gives(-49, 0, -4000, 0);
    gives(-49, 0, -4000, 0);
    setUp();
    config.d = (pulses_axis_config_t){.v = 4000, .low = -50, .high = 100};
    gives(100, 0, 4000, 0);
    gives(100, 0, -4000, 0);
    gives(-50, 0, 4000, 0);
}

/* The change to be expected, 20 in a period, fits into neither direction of a band of 20. */
void test_in_a_narrow_band_the_voltage_alternates(void)
{
    config.d = (pulses_axis_config_t){.v = 4000, .low = -10, .high = 10};
    gives(0, 0, 4000, 0);
    gives(0, 0, 4000, 0);
    gives(30, 0, -4000, 0);
    gives(20, 0, -4000, 0);
    gives(10, 0, 4000, 0);
}

/* After the second reversal: 90 + 90 + 90 + 100 - 100 = 270 for the sum. It ends only when the current is positive. */
void test_the_last_half_wave_has_the_sign_of_its_voltage(void)
{
    alternate_q(3);
    gives(0, 0, 0, 4000);
    gives(0, 90, 0, 4000);
    gives(0, 90, 0, 4000);
    gives(0, 90, 0, 4000);
    gives(0, 100, 0, -4000);
    gives(0, -100, 0, 4000);
    gives(0, -20, 0, 4000);
    gives(0, 0, 0, 4000);
    TEST_ASSERT_EQUAL_INT(PULSES_PULSE, state.phase);
    gives(0, 1, 0, -4000);
    TEST_ASSERT_EQUAL_INT(PULSES_BACK, state.phase);
}

/* Of two: the first has a sum of 100, the last one so far of -30. */
static void begin_last_half_wave(void)
{
    alternate_q(2);
    gives(0, 0, 0, 4000);
    gives(0, 0, 0, 4000);
    gives(0, 100, 0, -4000);
    gives(0, -30, 0, -4000);
}

/* 100 - 30 - 20 is as much as the half wave of -30 - 20, which the way back repeats. */
void test_the_last_half_wave_ends_when_twice_its_sum_balances_the_first(void)
{
    begin_last_half_wave();
    gives(0, -20, 0, 4000);
    TEST_ASSERT_EQUAL_INT(PULSES_BACK, state.phase);
}

void test_two_equal_currents_belong_to_one_half_wave(void)
{
    begin_last_half_wave();
    gives(0, -30, 0, 4000);
    TEST_ASSERT_EQUAL_INT(PULSES_BACK, state.phase);
}

void test_q_begins_after_its_delay(void)
{
    config.q.v = 3000;
    config.delay = 2;
    gives(0, 0, 8000, 0);
    gives(0, 0, 8000, 0);
    gives(0, 0, 8000, 3000);
}

void test_the_square_of_the_current_may_reach_its_limit(void)
{
    config.square_max = 25;
    gives(3, 4, 8000, 0);
    TEST_ASSERT_EQUAL_INT(PULSES_GOOD, state.failure);
    gives(3, 5, -8000, 0);
    TEST_ASSERT_EQUAL_INT(PULSES_CURRENT, state.failure);
}

static void assert_moves(uint32_t angle, pulses_failure_t failure)
{
    setUp();
    gives(0, 0, 8000, 0);
    theta += angle;
    (void)pulses_step(&config, &state, (dq_q15_t){0, 0}, theta);
    TEST_ASSERT_EQUAL_INT(failure, state.failure);
}

void test_the_rotor_may_move_by_the_largest_angle_in_both_directions(void)
{
    assert_moves(1000000U, PULSES_GOOD);
    assert_moves(1000001U, PULSES_MOVED);
    assert_moves(0U - 1000000U, PULSES_GOOD);
    assert_moves(0U - 1000001U, PULSES_MOVED);
    assert_moves(0U, PULSES_GOOD);
}

/* Each axis by its own current: a positive one needs a negative voltage. */
void test_the_way_back_is_against_the_current_of_each_axis(void)
{
    config.q.v = 3000;
    gives(1, 500, 8000, 3000);
    theta += 1000001U;
    gives(1, 500, -8000, -3000);
    setUp();
    config.q.v = 3000;
    gives(0, -500, 8000, 3000);
    theta += 1000001U;
    gives(0, -500, 8000, 3000);
}

/* 80 are left at a fall of 80 per period, which needs the whole voltage; at the end 10 at a fall of 40, which needs a
 * quarter of it. What remains then is left alone. */
void test_the_last_voltage_is_reduced_and_nothing_follows(void)
{
    config.q.v = 3000;
    gives(300, 9000, 8000, 3000);
    theta += 1000001U;
    gives(300, 9000, -8000, -3000);
    gives(240, 9000, -8000, -3000);
    gives(160, 9000, -8000, -3000);
    gives(120, 9000, -8000, -3000);
    gives(90, 9000, -8000, -3000);
    gives(50, 9000, -2000, -3000);
    gives(45, 9000, 0, -3000);
    gives(-45, 9000, 0, -3000);
}

/* The same from a negative current: 60 at a change of 90 need two thirds. */
void test_nothing_follows_the_reduced_voltage_in_the_other_direction_either(void)
{
    config.q.v = 3000;
    gives(-300, 9000, 8000, 3000);
    theta += 1000001U;
    gives(-300, 9000, 8000, -3000);
    gives(-240, 9000, 8000, -3000);
    gives(-150, 9000, 5333, -3000);
    gives(-145, 9000, 0, -3000);
}

void test_an_axis_that_has_crossed_zero_gets_no_more_voltage(void)
{
    config.q.v = 3000;
    gives(100, 9000, 8000, 3000);
    theta += 1000001U;
    gives(100, 9000, -8000, -3000);
    gives(-10, 9000, 0, -3000);
    gives(5, 9000, 0, -3000);
    TEST_ASSERT_EQUAL_INT(PULSES_BACK, state.phase);
}

/* Noise on an axis without voltage cannot be brought to zero. */
void test_an_axis_without_voltage_does_not_delay_the_end(void)
{
    gives(0, 50, 8000, 0);
    theta += 1000001U;
    gives(0, 50, 8000, 0);
    gives(0, 50, 0, 0);
    TEST_ASSERT_EQUAL_INT(PULSES_FAILED, state.phase);
}

void test_the_pulses_end_when_both_axes_are_at_zero(void)
{
    config.q.v = 3000;
    gives(0, 500, 8000, 3000);
    theta += 1000001U;
    gives(0, 500, 8000, -3000);
    gives(0, 400, 0, -3000);
    TEST_ASSERT_EQUAL_INT(PULSES_BACK, state.phase);
}

void test_without_a_new_number_nothing_begins(void)
{
    state = (pulses_state_t){.phase = PULSES_IDLE};
    config.number = 0;
    gives(7, 7, 0, 0);
    TEST_ASSERT_EQUAL_INT(PULSES_IDLE, state.phase);
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
