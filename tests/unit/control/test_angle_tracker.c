/* SPDX-License-Identifier: Apache-2.0 */
#include <math.h>

#include "control/current/angle_tracker.h"
#include "fixture.h"
#include "unity.h"

static fixture_t f;
static angle_tracker_state_t state;

static const double turn = 4294967296.0; /* counts per turn */
static const double two_pi = 6.283185307179586476925;

void setUp(void)
{
    f = fixture();
    state = (angle_tracker_state_t){0};
}

void tearDown(void)
{
}

static angle_t step(uint32_t theta_m)
{
    return angle_tracker_step(&f.angle_tracker, &state, theta_m);
}

/* As in the fast ISR: an implausible sample is replaced by the prediction. */
static angle_t step_or_coast(uint32_t theta_m)
{
    const angle_t y = step(theta_m);
    return y.jumped ? angle_tracker_coast(&f.angle_tracker, &state, y.theta_e) : y;
}

void test_the_electrical_angle_is_pole_pairs_times_mechanical_plus_offset_and_wraps(void)
{
    f.angle_tracker.offset = 0x12345678u;
    TEST_ASSERT_EQUAL_HEX32(0x12345678u, step(0).theta_e);
    TEST_ASSERT_EQUAL_HEX32(0xC0000000u + 0x12345678u, step(0x40000000u).theta_e);
    TEST_ASSERT_EQUAL_HEX32(0xFFFFFFFDu + 0x12345678u, step(0xFFFFFFFFu).theta_e);
}

/* 0.8 omega_b is an electrical advance of 0.05 turn per period, 0.05/3 turn mechanically. */
void test_the_speed_is_correct_from_the_second_sample_on_without_a_cycle_slip(void)
{
    const uint32_t advance = (uint32_t)(0.05 / 3.0 * turn);
    (void)step(0xF0000000u);
    TEST_ASSERT_EQUAL_INT(0, state.omega_q30);
    const angle_t y = step(0xF0000000u + advance);
    /* turn_to_pu in Q15.16 has a relative error of up to 1e-6. */
    TEST_ASSERT_DOUBLE_WITHIN(1e-6, 1.0, y.step / (3.0 * advance));
    TEST_ASSERT_DOUBLE_WITHIN(1e-5, 0.8, from_q31(y.omega_q31));
    TEST_ASSERT_FALSE(y.jumped);
}

/* An encoder finds its index at speed: the readings are larger from the next sample on. */
void test_a_zero_that_moves_is_no_movement_of_the_rotor(void)
{
    const uint32_t advance = (uint32_t)(0.05 / 3.0 * turn);
    const uint32_t by = 0xC0FFEE00U;
    (void)step(0xF0000000U);
    (void)step(0xF0000000U + advance);
    const angle_t before = step(0xF0000000U + 2U * advance);
    angle_tracker_move(&f.angle_tracker, &state, by);
    const angle_t y = step(0xF0000000U + by + 3U * advance);
    TEST_ASSERT_FALSE(y.jumped);
    TEST_ASSERT_INT_WITHIN(64, before.omega_q31, y.omega_q31);
    TEST_ASSERT_EQUAL_HEX32(3U * (0xF0000000U + by + 3U * advance) + f.angle_tracker.offset, y.theta_e);
}

/* omega_b T_s = 1.5 exceeds pu_to_turn's format: half of it, and a shift. */
void test_with_a_shift_a_field_that_turns_far_is_tracked_through_a_lost_sample(void)
{
    const double turns = 1.5 / two_pi; /* per period at omega_b */
    f.angle_tracker.turn_shift = 1;
    f.angle_tracker.pu_to_turn = (int32_t)lround(turns * 8589934592.0);
    f.angle_tracker.turn_to_pu = (int32_t)lround(0.5 / turns * 65536.0);
    const uint32_t advance = (uint32_t)(0.8 * turns / 3.0 * turn);
    for (uint32_t k = 0; k < 400; k++) {
        const bool lost = k == 300;
        const angle_t y = step_or_coast(k * advance + (lost ? 0x20000000U : 0U));
        TEST_ASSERT_EQUAL(lost, y.jumped);
        if (k > 0) {
            TEST_ASSERT_DOUBLE_WITHIN(2e-5, 1.0, y.step / (3.0 * advance));
            TEST_ASSERT_DOUBLE_WITHIN(2e-5, 0.8, from_q31(y.omega_q31));
        }
    }
}

/* A second-order tracking loop has no steady error on a ramp; what remains is the rounding of the speed. */
void test_a_ramp_is_tracked_without_a_speed_error_in_both_directions(void)
{
    for (int sign = -1; sign <= 1; sign += 2) {
        state = (angle_tracker_state_t){0};
        const int32_t advance = sign * 12345678;
        uint32_t theta = 77;
        for (int n = 0; n < 2000; n++) {
            (void)step(theta);
            theta += (uint32_t)advance;
        }
        TEST_ASSERT_INT_WITHIN(4, 3 * advance, step(theta).step);
    }
}

void test_a_speed_step_settles_with_both_poles_at_the_configured_bandwidth(void)
{
    (void)step(0);
    (void)step(0);
    const uint32_t advance = 20000000u;
    uint32_t theta = 0;
    double worst_overshoot = 0.0;
    for (int n = 0; n < 400; n++) {
        theta += advance;
        const angle_t y = step(theta);
        worst_overshoot = fmax(worst_overshoot, y.step / (3.0 * advance));
        if (n == 99) {
            /* After 10 ms, six time constants, (1 + 6) e^-6 = 1.7 % are missing; w_n T_s = 0.06 changes the poles. */
            TEST_ASSERT_DOUBLE_WITHIN(0.003, 1.0 - 0.01735, y.step / (3.0 * advance));
        }
    }
    /* Two equal real poles and no zero: no overshoot beyond the rounding. */
    TEST_ASSERT_DOUBLE_WITHIN(1e-6, 1.0, worst_overshoot);
}

/* Tolerance: gains in q31 (5e-10) times an error below 0.1 turn; each rounding of 2 LSB decays: below 100 LSB. */
void test_a_noisy_accelerating_rotor_gives_the_twins_angle_and_speed(void)
{
    twin_angle_state_t twin = {0};
    worst_t worst = {0};
    uint64_t seed = 31;
    double theta = 0.0;
    for (int n = 0; n < 200000; n++) {
        theta += 0.15 / 3.0 * sin(n * 1e-4); /* up to 0.38 omega_b either way */
        const int64_t noise = random_in(&seed, -1000000, 1000000);
        const uint32_t raw = (uint32_t)((int64_t)floor(fmod(theta, two_pi) / two_pi * turn) + noise);
        const angle_t y = step(raw);
        const twin_angle_t t = twin_angle_tracker(&f.si, &twin, raw / turn * two_pi);
        worst_note(&worst, y.step - t.step / two_pi * turn, "step of period %d", n);
        TEST_ASSERT_DOUBLE_WITHIN(1e-8, 0.0, twin_wrap(y.theta_e / turn * two_pi - t.theta));
    }
    ASSERT_WORST(worst, 100.0);
}

void test_the_speed_scale_is_one_at_omega_b(void)
{
    for (int n = -15; n <= 15; n++) {
        const double advance = n / 16.0 * f.w * 1e-4 / two_pi * turn / 3.0;
        state = (angle_tracker_state_t){0};
        (void)step(0);
        TEST_ASSERT_DOUBLE_WITHIN(1e-5, n / 16.0, from_q31(step((uint32_t)(int32_t)lround(advance)).omega_q31));
    }
}

void test_a_jump_beyond_the_plausible_step_is_reported_and_a_smaller_one_is_not(void)
{
    (void)step(0);
    (void)step(0);
    const uint32_t limit = f.angle_tracker.max_step / 3U;
    TEST_ASSERT_FALSE(step(limit).jumped);
    state = (angle_tracker_state_t){.samples = 2};
    TEST_ASSERT_TRUE(step(limit + 1U).jumped);
    state = (angle_tracker_state_t){.samples = 2};
    TEST_ASSERT_TRUE(step(0U - limit - 1U).jumped);
    state = (angle_tracker_state_t){.samples = 2};
    f.angle_tracker.max_step = 0x7FFFFFFEu;
    f.angle_tracker.pole_pairs = 1;
    TEST_ASSERT_TRUE(step(0x80000000u).jumped); /* half a turn: the magnitude of -2^31 does not fit 32 bits */
}

/* At constant speed the prediction of a locked loop is the true angle. */
void test_implausible_samples_are_replaced_by_the_prediction_and_do_not_change_the_speed(void)
{
    const uint32_t advance = 10000000u;
    uint32_t theta = 0;
    for (int n = 0; n < 3000; n++, theta += advance) {
        TEST_ASSERT_FALSE(step_or_coast(theta).jumped);
    }
    for (int n = 0; n < 200; n++, theta += advance) {
        const bool bad = n >= 10 && (n < 60 || n % 10 == 0);
        const angle_t y = step_or_coast(bad ? theta + 0x30000000u : theta);
        TEST_ASSERT_EQUAL(bad, y.jumped);
        TEST_ASSERT_INT_WITHIN(2000, 0,
                               (int32_t)(y.theta_e - 3U * theta)); /* 50 periods with a speed error of up to 4 LSB */
        TEST_ASSERT_INT_WITHIN(4, 3 * (int32_t)advance, y.step);
    }
}

/* Spikes and a frozen angle on an accelerating rotor: tracker and twin replace the same samples. */
void test_intermittent_angle_faults_give_the_twins_angle_and_speed(void)
{
    twin_angle_state_t twin = {0};
    worst_t worst = {0};
    double theta = 0.0, frozen = 0.0;
    int replaced = 0;
    for (int n = 0; n < 100000; n++) {
        theta += 0.15 / 3.0 * sin(n * 1e-4);
        frozen = (n % 500 >= 450) ? frozen : theta;
        const double sampled = (n % 7 == 6) ? theta + 1.0 : frozen;
        const uint32_t raw = (uint32_t)(int64_t)floor(fmod(sampled, two_pi) / two_pi * turn);
        const angle_t y = step_or_coast(raw);
        const twin_angle_t t = twin_angle_tracker(&f.si, &twin, raw / turn * two_pi);
        worst_note(&worst, y.step - t.step / two_pi * turn, "step of period %d", n);
        TEST_ASSERT_DOUBLE_WITHIN(1e-6, 0.0, twin_wrap(y.theta_e / turn * two_pi - t.theta));
        replaced += y.jumped ? 1 : 0;
    }
    ASSERT_WORST(worst, 100.0);
    TEST_ASSERT_GREATER_THAN(14000, replaced);
}

/* An angle that repeats. */

static uint32_t last_read, now_period;

/* As a period does it. */
static angle_repeat_t read_angle(uint32_t theta_m, angle_t *y)
{
    const bool repeated = theta_m == last_read;
    last_read = theta_m;
    now_period++;
    *y = step(theta_m);
    const angle_repeat_t meaning = repeated ? angle_tracker_repeated(&f.angle_tracker, &state, y, now_period)
                                            : ANGLE_FOLLOWED;
    if (meaning == ANGLE_STUCK) {
        *y = angle_tracker_coast(&f.angle_tracker, &state, y->theta_e);
    }
    return meaning;
}

/* A locked loop at so many units of the mechanical angle per period; the next angle. */
static uint32_t turn_at(int32_t advance)
{
    uint32_t theta = 12345;
    angle_t y;
    state = (angle_tracker_state_t){0};
    for (int n = 0; n < 3000; n++, theta += (uint32_t)advance) {
        TEST_ASSERT_EQUAL(ANGLE_FOLLOWED, read_angle(theta, &y));
    }
    return theta;
}

/* 3 10^7 of the electrical turn per period are beyond two counts of 12 bits, 6.3 10^6, in the first repeat. */
void test_a_turning_rotors_angle_that_repeats_is_replaced_by_the_prediction_from_the_first_repeat_on(void)
{
    for (int32_t advance = -10000000; advance <= 10000000; advance += 20000000) {
        uint32_t theta = turn_at(advance);
        const uint32_t frozen = last_read;
        angle_t y;
        for (int n = 0; n < 300; n++, theta += (uint32_t)advance) {
            TEST_ASSERT_EQUAL(ANGLE_STUCK, read_angle(frozen, &y));
            TEST_ASSERT_INT_WITHIN(5000, 0, (int32_t)(y.theta_e - 3U * theta));
            TEST_ASSERT_INT_WITHIN(100, 3 * advance, y.step);
            TEST_ASSERT_FALSE(angle_tracker_may_stop(&f.angle_tracker, &state));
        }
        TEST_ASSERT_EQUAL(ANGLE_FOLLOWED, read_angle(theta, &y)); /* the sensor is back */
        TEST_ASSERT_FALSE(y.jumped);
        TEST_ASSERT_INT_WITHIN(100, 3 * advance, y.step);
    }
}

/* 900 000 per period: the seventh repeat is beyond 6 291 456, or a later one, because the loop has begun to follow.
 * After 50 repeats a rotor may stand: it is followed. */
void test_a_slow_rotors_angle_is_replaced_for_5_ms_and_then_followed(void)
{
    for (int32_t advance = -300000; advance <= 300000; advance += 600000) {
        (void)turn_at(advance);
        angle_t y;
        for (int n = 1; n <= 50; n++) {
            const angle_repeat_t meaning = read_angle(last_read, &y);
            TEST_ASSERT_TRUE(meaning == ANGLE_STUCK || n < 9);
            TEST_ASSERT_TRUE(meaning == ANGLE_FOLLOWED || n >= 7);
            TEST_ASSERT_TRUE(angle_tracker_may_stop(&f.angle_tracker, &state));
        }
        TEST_ASSERT_EQUAL(ANGLE_STANDING, read_angle(last_read, &y));
        TEST_ASSERT_EQUAL_INT(0, y.omega_q31);
        TEST_ASSERT_EQUAL_INT(0, y.step);
        TEST_ASSERT_FALSE(y.jumped);
        for (int n = 0; n < 70000; n++) { /* beyond 16 bits */
            TEST_ASSERT_EQUAL(ANGLE_FOLLOWED, read_angle(last_read, &y));
        }
        TEST_ASSERT_EQUAL_UINT32(UINT16_MAX, state.repeats);
        TEST_ASSERT_EQUAL_INT(0, state.omega_q30);
    }
}

/* In 16 to 40 periods: the loop's lag shows it after 0.77/(w_n T_s) = 13 periods (AT-17). */
void test_a_rotor_that_is_stopped_is_followed(void)
{
    for (int sign = -1; sign <= 1; sign += 2) {
        for (int32_t slower = 100000; slower <= 250000; slower += 50000) {
            int32_t advance = sign * 4000000;
            uint32_t theta = turn_at(advance);
            angle_t y;
            for (int n = 0; n < 400; n++, theta += (uint32_t)advance) {
                TEST_ASSERT_EQUAL(ANGLE_FOLLOWED, read_angle(theta, &y));
                advance -= sign * ((sign * advance > slower) ? slower : sign * advance);
            }
            TEST_ASSERT_INT_WITHIN(10000, 0, y.step);
        }
    }
}

/* 6 291 456 in 50 periods: 125 829 per period. */
/* The loop of a machine of so many pole pairs at 8 kHz, 300 rad/s, base 942 rad/s, and a sensor of 12 bits. The rotor
 * turns at a speed (share of the base) until it stops as (SS-5) assumes, or its sensor repeats itself. Returns how
 * often that counts as a failure of the sensor within 5 ms. stop_share: tracked speed up to which it does not. */
static int failures_at(double share, int phase, bool frozen, unsigned pole_pairs, double stop_share)
{
    f.angle_tracker = (angle_tracker_config_t){.pole_pairs = pole_pairs,
                                               .kp = 161061274,
                                               .ki_q29 = 40265318,
                                               .pu_to_turn = 322122547,
                                               .turn_to_pu = 1747627,
                                               .max_step = 214748364,
                                               .repeat_max = pole_pairs << 21,
                                               .lag_steps = 5,
                                               .stop_speed_q30 = (int32_t)(stop_share * 1073741824.0),
                                               .stop_periods = 40};
    const double base = turn * 942.5 / 8000.0 / two_pi / pole_pairs, slower = base / 250.0 / 8.0, count = turn / 4096.0;
    double advance = share * base, theta = phase * count / 32.0;
    angle_t y;
    state = (angle_tracker_state_t){0};
    for (int n = 0; n < 2000; n++, theta += advance) {
        (void)read_angle((uint32_t)(int64_t)(floor(theta / count) * count), &y);
    }
    const uint32_t last = last_read;
    int failures = 0, standing = 0;
    while (standing < 40) {
        const uint32_t read = frozen ? last : (uint32_t)(int64_t)(floor(theta / count) * count);
        const bool stuck = read_angle(read, &y) == ANGLE_STUCK;
        failures += (stuck && !angle_tracker_may_stop(&f.angle_tracker, &state)) ? 1 : 0;
        standing += (frozen || advance == 0.0) ? 1 : 0;
        advance = (advance > slower) ? advance - slower : 0.0;
        theta += advance;
    }
    return failures;
}

/* The lag is measured to a count (AT-17). A fault needs more than 40 failures. */
void test_a_rotor_that_stops_is_followed_with_the_resolution_of_12_bits(void)
{
    for (int share = 20; share <= 60; share++) {
        for (int phase = 0; phase < 32; phase++) {
            TEST_ASSERT_LESS_THAN_INT(20, failures_at(0.001 * share, phase, false, 2, 0.02));
        }
    }
}

/* With 18 pole pairs a count is 1.6 degrees electrical and the largest lag 2.4: a count may hide the lag, and the
 * tracked speed is up to twice the 0.0267 by which it is behind (AT-21). With 0.02 each sample of the 5 ms fails. */
void test_a_rotor_that_stops_is_followed_where_a_count_hides_its_lag(void)
{
    int worst = 0;
    for (int share = 20; share <= 100; share++) {
        for (int phase = 0; phase < 32; phase++) {
            TEST_ASSERT_EQUAL_INT(0, failures_at(0.001 * share, phase, false, 18, 4.0 / 250e-3 / 300.0));
            worst = (int)fmax(worst, failures_at(0.001 * share, phase, false, 18, 0.02));
        }
    }
    TEST_ASSERT_GREATER_THAN_INT(39, worst);
}

void test_a_sensor_of_12_bits_that_repeats_itself_above_the_speed_of_a_stop_is_found(void)
{
    for (int share = 21; share <= 100; share++) {
        for (int phase = 0; phase < 32; phase++) {
            TEST_ASSERT_GREATER_THAN_INT(30, failures_at(0.001 * share, phase, true, 2, 0.02));
        }
    }
    /* Also where a count is a large part of the lag that shows a stop. */
    for (unsigned pole_pairs = 15; pole_pairs <= 45; pole_pairs += 15) {
        for (int phase = 0; phase < 32; phase++) {
            TEST_ASSERT_GREATER_THAN_INT(0, failures_at(0.1, phase, true, pole_pairs, 4.0 / 250e-3 / 300.0));
        }
    }
}

void test_a_rotor_that_turns_by_less_than_two_counts_in_5_ms_cannot_stick(void)
{
    for (int sign = -1; sign <= 1; sign += 2) {
        (void)turn_at(sign * 41000);
        TEST_ASSERT_FALSE(angle_tracker_may_stick(&f.angle_tracker, &state));
        (void)turn_at(sign * 43000);
        TEST_ASSERT_TRUE(angle_tracker_may_stick(&f.angle_tracker, &state));
    }
}

/* A 12-bit sensor repeats each angle three or four times; that is no failure, however long it goes on. */
void test_the_repeats_of_a_slow_rotor_do_not_add_up(void)
{
    uint32_t theta = turn_at(300000);
    angle_t y;
    for (int n = 0; n < 5000; n++, theta += 300000U) {
        TEST_ASSERT_EQUAL(ANGLE_FOLLOWED, read_angle(theta & 0xFFF00000U, &y));
    }
    TEST_ASSERT_LESS_THAN(5, state.repeats);
}

/* Rounding has no bias: an angle that alternates by one LSB must not accumulate to a speed. */
void test_at_standstill_an_angle_jitter_of_one_lsb_leaves_the_speed_at_zero(void)
{
    (void)step(1000);
    (void)step(1000);
    for (int n = 0; n < 1000000; n++) {
        (void)step(1000U + (uint32_t)(n & 1));
    }
    TEST_ASSERT_INT_WITHIN(16, 0, state.omega_q30);
}
