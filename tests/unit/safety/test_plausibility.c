/* SPDX-License-Identifier: Apache-2.0 */
#include "safety/plausibility.h"

#include <math.h>
#include <stdlib.h>

#include "types/faults.h"
#include "unity.h"

static const plausibility_config_t config = {.answer_rate = Q15_MAX,
                                             .e_0 = 2000,
                                             .i_dead = 400,
                                             .i_alive = 2400,
                                             .ripple_max = 1600,
                                             .zero_error_max = 492,
                                             .behind_gain = 4 * Q16_ONE,
                                             .omega_trip = 32000,
                                             .inverter_trip_dC = 1050,
                                             .winding_trip_dC = 1800,
                                             .deviation_steps = 100,
                                             .gate_exceeded_steps = 60,
                                             .ripple_steps = 20,
                                             .lost_steps = 10,
                                             .equal_steps = 20,
                                             .fast_steps = 5,
                                             .hot_steps = 110};
static plausibility_state_t state;
static plausibility_in_t in;
static int now;

void setUp(void)
{
    state = (plausibility_state_t){0};
    now = 0;
    in = (plausibility_in_t){.acting = true,
                             .i = {-8000, 8000},
                             .i_ref = {-8000, 8000},
                             .i_mean = {-8000, 8000},
                             .omega = 10000,
                             .known_permille = 1000};
}

void tearDown(void)
{
}

/* One step, in which the machine turns by 0.7 rad; the phase `broken` carries no current. */
static uint32_t run_one_turn(int broken)
{
    const double a = 0.7 * now++;
    const int32_t want[3] = {(int32_t)(11314 * cos(a)), (int32_t)(11314 * cos(a - 2.0944)),
                             (int32_t)(11314 * cos(a + 2.0944))};
    in.phases_ref = (abc_q15_t){want[0], want[1], want[2]};
    in.phases = (abc_q15_t){broken == 0 ? now % 3 : want[0], broken == 1 ? now % 3 : want[1],
                            broken == 2 ? now % 3 : want[2]};
    return plausibility_step(&config, &state, &in);
}

static int steps_until(uint32_t fault, int broken)
{
    for (int n = 1; n <= 1000; n++) {
        if (run_one_turn(broken) & fault) {
            return n;
        }
    }
    return -1;
}

/* Repeats the same sample until the fault. */
static int steps_until_the_same(uint32_t fault)
{
    for (int n = 1; n <= 1000; n++) {
        if (plausibility_step(&config, &state, &in) & fault) {
            return n;
        }
    }
    return -1;
}

void test_currents_that_follow_their_references_raise_nothing(void)
{
    TEST_ASSERT_EQUAL_INT(-1, steps_until(UINT32_MAX, -1));
}

/* The threshold is e_0 + |i_ref|/8 = 2000 + 1414. */
void test_a_current_off_its_reference_is_found_in_20_ms_and_in_100_at_the_voltage_limit(void)
{
    in.i.q = in.i_ref.q - 3415;
    TEST_ASSERT_EQUAL_INT(20, steps_until(FAULT_CONTROL, -1));
    setUp();
    (void)run_one_turn(-1); /* a good step: nothing is counted before */
    in.i.q = in.i_ref.q - 3415;
    in.voltage_limited = true;
    TEST_ASSERT_EQUAL_INT(100, steps_until(FAULT_CONTROL, -1));
    setUp();
    in.i.q = in.i_ref.q - 3414;
    TEST_ASSERT_EQUAL_INT(-1, steps_until(FAULT_CONTROL, -1));
}

/* The mean of 16 samples is far below ripple_max. */
void test_a_deviation_every_eighth_sample_is_noise(void)
{
    for (int n = 0; n < 1000; n++) {
        in.i.q = in.i_ref.q + ((n % 8 == 0) ? 5000 : 0);
        TEST_ASSERT_EQUAL_HEX32(0, run_one_turn(-1));
    }
}

/* (MN-11) in double precision: steps until the fault for a deviation that alternates between 0 and `size`. */
static int steps_of_the_twin(double size)
{
    double mean = 0.0, ripple = 0.0;
    int bad = 0;
    for (int n = 1; n <= 1000; n++) {
        const double e = (n & 1) ? fmin(size, 4.0 * config.ripple_max) : 0.0;
        ripple += (fabs(e - mean) - ripple) / 16.0;
        mean += (e - mean) / 8.0;
        bad = (ripple > config.ripple_max) ? bad + 1 : 0;
        if (bad == config.ripple_steps) {
            return n;
        }
    }
    return -1;
}

static void find_oscillations(bool of_sample, bool of_d)
{
    for (int32_t size = 2900; size <= 8000; size += 100) {
        setUp();
        int found = -1;
        for (int n = 1; n <= 1000 && found < 0; n++) {
            const int32_t change = (n & 1) ? size : 0;
            dq_q15_t *i = of_sample ? &in.i : &in.i_mean;
            *i = (dq_q15_t){in.i_ref.d + (of_d ? change : 0), in.i_ref.q + (of_d ? 0 : change)};
            found = (run_one_turn(-1) & FAULT_CONTROL) ? n : -1;
        }
        const int expected = steps_of_the_twin(size);
        const bool same = abs(found - expected) <= 1; /* rounding may shift the fault by a step */
        TEST_ASSERT_TRUE_MESSAGE(same || abs(size - 3200) <= 100, "fixed point and double precision differ");
    }
}

void test_a_deviation_every_other_sample_is_found_by_its_oscillation(void)
{
    find_oscillations(true, true);
    find_oscillations(true, false);
}

void test_an_oscillation_that_only_the_means_of_the_steps_show_is_found(void)
{
    find_oscillations(false, true);
    find_oscillations(false, false);
}

void test_a_lasting_deviation_is_no_oscillation(void)
{
    in.i.d = in.i_mean.d = in.i_ref.d + 3000;
    TEST_ASSERT_EQUAL_INT(-1, steps_until(FAULT_CONTROL, -1));
}

/* A slope of 400 per step of the reference, and a current that follows 1/16 of what is missing. It lags by 6400. */
void test_a_current_that_follows_as_slowly_as_expected_is_no_deviation(void)
{
    plausibility_config_t slow = config;
    slow.e_0 = 300;
    for (int known = 0; known <= 1; known++) {
        slow.answer_rate = known ? (q15_t)2048 : Q15_MAX;
        setUp();
        double current = 0.0;
        uint32_t found = 0;
        for (int n = 0; n < 60; n++) {
            in.i_ref = (dq_q15_t){0, 400 * n};
            current += 0.0625 * (in.i_ref.q - current);
            in.i = in.i_mean = (dq_q15_t){0, (int32_t)lround(current)};
            in.phases = in.phases_ref = (abc_q15_t){n % 3, n % 5, n % 7};
            found |= plausibility_step(&slow, &state, &in);
        }
        TEST_ASSERT_EQUAL_HEX32(known ? 0 : FAULT_CONTROL, found);
    }
}

/* The torque passes through zero as a slow law does it: a phase in which the reference has changed its sign, but not
 * yet the current, carries the current that is expected of it. */
void test_a_phase_whose_current_follows_slowly_is_not_lost(void)
{
    plausibility_config_t slow = config;
    for (int known = 0; known <= 1; known++) {
        slow.answer_rate = known ? (q15_t)1024 : Q15_MAX;
        setUp();
        double current = 12000.0;
        state.expected = (dq_q15_t){0, 12000};
        uint32_t found = 0;
        for (int n = 0; n < 60; n++) {
            in.i_ref = (dq_q15_t){0, (n < 40) ? 12000 - 600 * n : -12000};
            current += 0.03125 * (in.i_ref.q - current);
            const int32_t now_i = (int32_t)lround(current), half = now_i / 2;
            const dq_q15_t expected = plausibility_expected(&slow, &state, in.i_ref);
            in.i = in.i_mean = (dq_q15_t){0, now_i};
            in.phases = (abc_q15_t){now_i, -half, -half};
            in.phases_ref = (abc_q15_t){expected.q, -expected.q / 2, -expected.q / 2};
            found |= plausibility_step(&slow, &state, &in);
        }
        TEST_ASSERT_EQUAL_HEX32(known ? 0 : FAULT_PHASE_LOST, found & FAULT_PHASE_LOST);
    }
}

/* One sample beyond its threshold, which is e_0 + |i_ref|/8 = 4000 of the reference of this step, is a fault here. */
void test_the_reference_counts_at_once_where_current_control_answers_at_once(void)
{
    plausibility_config_t strict = config;
    strict.deviation_steps = 5;
    for (int32_t beyond = 0; beyond <= 1; beyond++) {
        setUp();
        in.i_ref = in.i = in.i_mean = (dq_q15_t){0, -16000};
        TEST_ASSERT_EQUAL_HEX32(0, plausibility_step(&strict, &state, &in));
        in.i_ref = in.i_mean = (dq_q15_t){0, 16000};
        in.i = (dq_q15_t){0, 20000 + beyond};
        TEST_ASSERT_EQUAL_HEX32(beyond ? FAULT_CONTROL : 0U, plausibility_step(&strict, &state, &in));
    }
}

/* 640^2 + 800^2 = 1024^2 + 1024, whose root rounds to 1024. */
void test_a_deviation_counts_from_the_rounded_limit_on(void)
{
    plausibility_config_t strict = config;
    strict.e_0 = 1024;
    strict.deviation_steps = 5;
    for (int32_t beyond = 0; beyond <= 1; beyond++) {
        setUp();
        in.i_ref = in.i_mean = (dq_q15_t){0, 0};
        in.i = (dq_q15_t){640, 800 + beyond};
        TEST_ASSERT_EQUAL_HEX32(beyond ? FAULT_CONTROL : 0U, plausibility_step(&strict, &state, &in) & FAULT_CONTROL);
    }
}

void test_a_phase_without_current_is_found_within_20_ms_whichever_it_is(void)
{
    for (int x = 0; x < 3; x++) {
        setUp();
        const int found = steps_until(FAULT_PHASE_LOST, x);
        TEST_ASSERT_TRUE(found > 0 && found <= 20);
    }
}

/* With an open switch the phase carries no current in one direction. */
void test_a_phase_without_current_in_one_direction_is_found_within_50_ms(void)
{
    for (int direction = -1; direction <= 1; direction += 2) {
        for (int32_t size = 3000; size <= 30000; size += 9000) {
            setUp();
            in.i_ref = in.i = in.i_mean = (dq_q15_t){0, size};
            int found = -1;
            for (int n = 1; n <= 50 && found < 0; n++) {
                const int32_t a = (int32_t)(size * cos(2.0 * n));
                in.phases_ref = (abc_q15_t){a, 0, 0};
                in.phases = (abc_q15_t){(direction * a > 0) ? 3 : a, 0, 0};
                found = (plausibility_step(&config, &state, &in) & FAULT_PHASE_LOST) ? n : -1;
            }
            TEST_ASSERT_TRUE(found > 10);
        }
    }
}

/* A current in the wrong direction counts as none. A phase is checked only if its reference is above an eighth of the
 * length of the current reference. */
void test_a_phase_is_lost_only_if_its_reference_is_large_enough(void)
{
    in.i_ref = in.i = in.i_mean = (dq_q15_t){0, 24000};
    in.phases_ref = in.phases = (abc_q15_t){3000, -6000, 3000};
    in.phases.a = -2999;
    TEST_ASSERT_EQUAL_INT(-1, steps_until_the_same(FAULT_PHASE_LOST));
    setUp();
    in.i_ref = in.i = in.i_mean = (dq_q15_t){0, 24000};
    in.phases_ref = in.phases = (abc_q15_t){3001, -6001, 3000};
    TEST_ASSERT_EQUAL_HEX32(0, plausibility_step(&config, &state, &in)); /* nothing is counted before */
    in.phases.a = -2999;
    TEST_ASSERT_EQUAL_INT(10, steps_until_the_same(FAULT_PHASE_LOST));
    state = (plausibility_state_t){0};
    in.phases.a = config.i_dead;
    TEST_ASSERT_EQUAL_INT(10, steps_until_the_same(FAULT_PHASE_LOST));
    state = (plausibility_state_t){0};
    in.phases.a = config.i_dead + 1;
    TEST_ASSERT_EQUAL_INT(-1, steps_until_the_same(FAULT_PHASE_LOST));
}

/* While 500 of the rotational voltage are missing, a current may be off its reference by 2000: with an alive threshold
 * of 3000, a phase whose reference is up to 5000 may be without current. */
void test_a_phase_is_not_lost_while_the_tracked_speed_is_behind(void)
{
    in.u_behind = 500;
    in.i_ref = in.i = in.i_mean = (dq_q15_t){0, 24000};
    in.phases_ref = in.phases = (abc_q15_t){5000, -10000, 5000};
    in.phases.a = 0;
    TEST_ASSERT_EQUAL_INT(-1, steps_until_the_same(FAULT_PHASE_LOST));
    in.phases_ref.a = 5001;
    TEST_ASSERT_EQUAL_INT(10, steps_until_the_same(FAULT_PHASE_LOST));
}

/* A phase without current is not lost if its reference is zero at this angle. */
void test_a_phase_at_its_zero_crossing_is_not_missed(void)
{
    in.phases_ref = (abc_q15_t){0, 9800, -9800};
    for (int n = 0; n < 1000; n++) {
        in.phases = (abc_q15_t){n % 5, 9800 + n % 3, -9800 - n % 7};
        TEST_ASSERT_EQUAL_HEX32(0, plausibility_step(&config, &state, &in));
    }
}

/* Steps until the sensor of phase x, which repeats itself, is found; the others' sum moves by `change` per step. */
static int steps_until_stuck(int x, int32_t change)
{
    for (int n = 1; n <= 100; n++) {
        const int32_t moves = (n & 1) ? 3000 : 3000 + change;
        const int32_t of[3] = {x == 0 ? 5000 : -2 * moves, x == 1 ? 5000 : (x == 0 ? -2 * moves : 3 * moves),
                               x == 2 ? 5000 : 3 * moves};
        in.phases = in.phases_ref = (abc_q15_t){of[0], of[1], of[2]};
        if (plausibility_step(&config, &state, &in) & FAULT_CURRENT_STUCK) {
            return n;
        }
    }
    return -1;
}

void test_a_sensor_that_repeats_itself_20_times_while_the_others_sum_moves_is_stuck(void)
{
    for (int x = 0; x < 3; x++) {
        setUp();
        TEST_ASSERT_EQUAL_INT(21, steps_until_stuck(x, 101)); /* the first sample has none before it; i_dead/4 = 100 */
        setUp();
        TEST_ASSERT_EQUAL_INT(-1, steps_until_stuck(x, 100));
    }
}

void test_a_sensor_that_changes_after_19_equal_samples_is_not_stuck(void)
{
    for (int n = 0; n < 1000; n++) {
        const int32_t moves = (n & 1) ? 3000 : 3101, repeated = 5000 + 5 * (n / 20);
        in.phases = in.phases_ref = (abc_q15_t){repeated, -2 * moves, 3 * moves};
        TEST_ASSERT_EQUAL_HEX32(0, plausibility_step(&config, &state, &in) & FAULT_CURRENT_STUCK);
    }
}

/* The rounding of measure_phases() changes a repeated value by up to 4 LSB (test_measure.c). */
void test_a_sensor_that_repeats_itself_within_the_rounding_of_the_phases_is_stuck(void)
{
    for (int n = 1; n <= 20; n++) {
        in.phases = in.phases_ref = (abc_q15_t){5000 + 4 * (n & 1), -6000 - 202 * (n & 1), 9000 + 303 * (n & 1)};
        TEST_ASSERT_EQUAL_HEX32(0, plausibility_step(&config, &state, &in) & FAULT_CURRENT_STUCK);
    }
    in.phases = in.phases_ref = (abc_q15_t){5004, -6202, 9303};
    TEST_ASSERT_EQUAL_HEX32(FAULT_CURRENT_STUCK, plausibility_step(&config, &state, &in) & FAULT_CURRENT_STUCK);
    setUp();
    for (int n = 0; n < 1000; n++) {
        in.phases = in.phases_ref = (abc_q15_t){5000 + 5 * (n & 1), -6000 - 202 * (n & 1), 9000 + 303 * (n & 1)};
        TEST_ASSERT_EQUAL_HEX32(0, plausibility_step(&config, &state, &in) & FAULT_CURRENT_STUCK);
    }
}

/* The last sample before the bridge was off is the one before the first. */
void test_a_sensor_that_repeats_itself_since_before_the_bridge_was_off_is_found_a_step_earlier(void)
{
    in.phases = (abc_q15_t){5000, -6202, 9303};
    (void)plausibility_step(&config, &state, &in);
    in.acting = false;
    (void)plausibility_step(&config, &state, &in);
    in.acting = true;
    TEST_ASSERT_EQUAL_INT(20, steps_until_stuck(0, 101));
}

/* Surface magnets at rest where one phase carries nothing: quiet sensors repeat its value while the torque changes. */
void test_a_phase_that_repeats_itself_while_the_others_move_against_each_other_is_healthy(void)
{
    for (int x = 0; x < 3; x++) {
        setUp();
        for (int n = 0; n < 1000; n++) {
            const int32_t i = (n & 1) ? 9000 : -9000;
            in.phases = in.phases_ref = (abc_q15_t){x == 0 ? 0 : i, x == 1 ? 0 : (x == 0 ? i : -i), x == 2 ? 0 : -i};
            TEST_ASSERT_EQUAL_HEX32(0, plausibility_step(&config, &state, &in) & FAULT_CURRENT_STUCK);
        }
    }
}

/* A quantised current near the edge of a step changes by one step of 16 counts while another phase repeats. */
void test_phases_that_change_by_one_quantisation_step_are_not_stuck(void)
{
    for (int n = 0; n < 1000; n++) {
        in.phases = in.phases_ref = (abc_q15_t){5000, -2500 + 16 * (n & 1), -2500 - 16 * (n & 1)};
        TEST_ASSERT_EQUAL_HEX32(0, plausibility_step(&config, &state, &in));
    }
}

void test_equal_currents_at_standstill_are_not_stuck(void)
{
    in.phases = in.phases_ref = (abc_q15_t){5000, -2500, -2500};
    for (int n = 0; n < 1000; n++) {
        TEST_ASSERT_EQUAL_HEX32(0, plausibility_step(&config, &state, &in));
    }
}

void test_a_mismatch_of_60_steps_is_a_fault_of_the_torque(void)
{
    in.gate_exceeded_steps = 59;
    TEST_ASSERT_EQUAL_HEX32(0, run_one_turn(-1));
    in.gate_exceeded_steps = 60;
    TEST_ASSERT_EQUAL_HEX32(FAULT_TORQUE, run_one_turn(-1));
    in.acting = false;
    TEST_ASSERT_EQUAL_HEX32(0, run_one_turn(-1));
}

void test_over_speed_needs_five_samples_in_a_row_in_either_direction(void)
{
    for (int sign = -1; sign <= 1; sign += 2) {
        setUp();
        in.omega = (q15_t)(sign * 32001);
        TEST_ASSERT_EQUAL_INT(5, steps_until(FAULT_OVER_SPEED, -1));
        in.omega = (q15_t)(sign * 32000);
        TEST_ASSERT_EQUAL_HEX32(0, run_one_turn(-1));
    }
}

void test_over_temperature_is_confirmed_after_110_ms_also_at_rest(void)
{
    in.acting = false;
    in.inverter_dC = 1050;
    TEST_ASSERT_EQUAL_INT(110, steps_until(FAULT_TEMPERATURE, -1));
    setUp();
    in.winding_dC = 1800;
    TEST_ASSERT_EQUAL_INT(110, steps_until(FAULT_TEMPERATURE, -1));
    setUp();
    in.inverter_dC = INT16_MIN; /* unknown */
    in.winding_dC = 1799;
    TEST_ASSERT_EQUAL_INT(-1, steps_until(FAULT_TEMPERATURE, -1));
}

void test_over_speed_is_found_while_the_bridge_does_not_act(void)
{
    in.acting = false;
    in.omega = 32001;
    TEST_ASSERT_EQUAL_INT(5, steps_until(FAULT_OVER_SPEED, -1));
}

/* 19 of 20 steps of a deviation, then the bridge is off for a step. */
void test_what_was_counted_before_the_bridge_was_off_does_not_count_afterwards(void)
{
    for (int round = 0; round < 3; round++) {
        in.acting = true;
        in.i.q = in.i_ref.q - 3500;
        for (int n = 0; n < 19; n++) {
            TEST_ASSERT_EQUAL_HEX32(0, run_one_turn(-1));
        }
        in.acting = false;
        TEST_ASSERT_EQUAL_HEX32(0, run_one_turn(-1));
    }
}

void test_while_the_bridge_does_not_act_nothing_is_checked(void)
{
    in.acting = false;
    in.i = (dq_q15_t){0, 0};
    TEST_ASSERT_EQUAL_INT(-1, steps_until(UINT32_MAX, 0));
}

void test_a_reference_that_is_6_percent_wrong_is_found_in_ten_steps_whether_the_bridge_acts_or_not(void)
{
    static const int16_t wrong[] = {0, 939, 1061, 1429, 4998};
    for (int n = 0; n < 5; n++) {
        setUp();
        in.known_permille = wrong[n];
        TEST_ASSERT_EQUAL_INT(10, steps_until(FAULT_INPUT, -1));
        setUp();
        in.acting = false;
        in.known_permille = wrong[n];
        TEST_ASSERT_EQUAL_INT(10, steps_until(FAULT_INPUT, -1));
    }
}

void test_a_reference_within_6_percent_is_right_and_so_is_none(void)
{
    static const int16_t right[] = {-1, 940, 970, 1030, 1060};
    for (int n = 0; n < 5; n++) {
        setUp();
        in.known_permille = right[n];
        TEST_ASSERT_EQUAL_INT(-1, steps_until(FAULT_INPUT, -1));
    }
}

void test_single_wrong_readings_of_the_reference_are_no_fault(void)
{
    for (int n = 0; n < 1000; n++) {
        in.known_permille = (n % 10 == 0) ? 1000 : 1200;
        TEST_ASSERT_EQUAL_HEX32(0, run_one_turn(-1) & FAULT_INPUT);
    }
}

void test_a_current_that_cannot_flow_is_found_in_50_steps_in_each_phase_and_direction(void)
{
    for (int n = 0; n < 6; n++) {
        const int32_t wrong = (n & 1) ? 493 : -493;
        setUp();
        in.acting = false;
        in.at_rest = true;
        (void)plausibility_step(&config, &state, &in); /* a good step: nothing is counted before */
        in.phases = (abc_q15_t){(n / 2 == 0) ? wrong : 0, (n / 2 == 1) ? wrong : 0, (n / 2 == 2) ? wrong : 0};
        TEST_ASSERT_EQUAL_INT(50, steps_until_the_same(FAULT_INPUT));
    }
}

void test_a_zero_within_its_tolerance_and_a_current_that_can_flow_are_no_fault(void)
{
    in.acting = false;
    in.at_rest = true;
    in.phases = (abc_q15_t){492, -492, 492};
    TEST_ASSERT_EQUAL_INT(-1, steps_until_the_same(FAULT_INPUT));
    in.at_rest = false;
    in.phases = (abc_q15_t){9000, -9000, 0};
    TEST_ASSERT_EQUAL_INT(-1, steps_until_the_same(FAULT_INPUT));
}

void test_noise_beyond_the_tolerance_of_zero_in_half_of_the_samples_is_no_fault(void)
{
    in.acting = false;
    in.at_rest = true;
    for (int n = 0; n < 1000; n++) {
        in.phases = (abc_q15_t){(n & 1) ? 2000 : 0, 0, 0};
        TEST_ASSERT_EQUAL_HEX32(0, plausibility_step(&config, &state, &in));
    }
}
