/* SPDX-License-Identifier: Apache-2.0 */
#include "safety/safe_state.h"

#include <math.h>

#include "unity.h"

/* With psi_f = 0.4 the line back-EMF is 0.6928 w. With v_dc = 0.6 the safe state is the short circuit above w = 0.7794,
 * and switching disabled below 0.6928. */
static const safe_state_config_t config = {
    .psi_f = 13107, .share_short = 58982, .share_open = 52429, .v_release = 24000};
static safe_state_state_t state;
static safe_state_in_t in;

void setUp(void)
{
    state = (safe_state_state_t){0};
    in = (safe_state_in_t){.v_dc = 19661, .speed_valid = true, .currents_valid = true};
}

void tearDown(void)
{
}

static bool steps(int count)
{
    bool short_circuit = false;
    for (int k = 0; k < count; k++) {
        short_circuit = safe_state_step(&config, &state, &in);
    }
    return short_circuit;
}

/* After 250 steps the known speed has followed any decrease. */
static bool at(double omega)
{
    in.omega = (q15_t)(omega * 32768.0);
    return steps(251);
}

static double known(void)
{
    return state.speed / 32768.0;
}

/* The flux and current of a shorted machine, turned by this angle against the rotor frame of the drive. */
static void short_circuit_currents(double length, double angle, double angle_a_period_before)
{
    const double psi = length * config.psi_f;
    in.psi_current = (dq_q15_t){(int32_t)(-psi * cos(angle)), (int32_t)(-psi * sin(angle))};
    in.i = (dq_q15_t){in.psi_current.d / 2, in.psi_current.q / 2};
    in.i_last_period = (dq_q15_t){(int32_t)(-psi / 2.0 * cos(angle_a_period_before)),
                                  (int32_t)(-psi / 2.0 * sin(angle_a_period_before))};
}

void test_at_low_speed_switching_is_disabled_and_at_high_speed_the_phases_are_shorted(void)
{
    TEST_ASSERT_FALSE(at(0.0));
    TEST_ASSERT_FALSE(at(0.5));
    TEST_ASSERT_TRUE(at(0.9));
    TEST_ASSERT_TRUE(at(-0.9));
    TEST_ASSERT_FALSE(at(-0.5));
}

/* 32767/32768 of 18000 is 17999, and sqrt(3) times that 31175.2. */
void test_the_line_back_emf_is_that_of_speed_and_flux_to_the_nearest_count(void)
{
    safe_state_config_t c = config;
    c.psi_f = 18000;
    in.omega = 32767;
    (void)safe_state_step(&c, &state, &in);
    TEST_ASSERT_EQUAL_INT16(31175, state.line_emf);
}

void test_between_the_thresholds_the_decision_stays(void)
{
    TEST_ASSERT_FALSE(at(0.778));
    TEST_ASSERT_TRUE(at(0.781));
    TEST_ASSERT_TRUE(at(0.695));
    TEST_ASSERT_FALSE(at(0.691));
    TEST_ASSERT_FALSE(at(0.778));
}

/* With the short circuit from 1.06 v_dc = 0.636 on, w = 0.918, to 0.96 v_dc, w = 0.8314, the diodes conduct from v_dc,
 * w = 0.866, to 0.9 v_dc, w = 0.7794. Without a valid speed the lower levels are the only ones. */
void test_with_a_level_above_the_dc_voltage_the_diodes_conduct_before_the_phases_are_shorted(void)
{
    static const struct {
        double omega;
        bool speed_valid, rectifies, shorted;
    } cases[] = {{0.864, true, false, false}, {0.868, true, true, false}, {0.916, true, true, false},
                 {0.920, true, true, true},   {0.834, true, true, true},  {0.829, true, true, false},
                 {0.916, true, true, false},  {0.782, true, true, false}, {0.777, true, false, false},
                 {0.834, true, false, false}, {0.834, false, true, true}};
    safe_state_config_t c = config;
    c.share_short = 69468;
    c.share_open = 62915;
    for (unsigned n = 0; n < sizeof cases / sizeof cases[0]; n++) {
        in.omega = (q15_t)(cases[n].omega * 32768.0);
        in.speed_valid = cases[n].speed_valid;
        bool shorted = false;
        for (int k = 0; k < 251; k++) {
            shorted = safe_state_step(&c, &state, &in);
        }
        TEST_ASSERT_EQUAL(cases[n].rectifies, state.rectifies);
        TEST_ASSERT_EQUAL(cases[n].shorted, shorted);
    }
}

void test_up_to_the_dc_voltage_both_levels_are_the_same(void)
{
    for (int k = 0; k < 200; k++) {
        in.omega = (q15_t)(((k < 100) ? k : 200 - k) * 327);
        const bool shorted = steps(1);
        TEST_ASSERT_EQUAL(shorted, state.rectifies);
    }
}

void test_a_stronger_identified_magnet_counts_and_a_weaker_one_does_not(void)
{
    in.psi_d_error = 1311; /* 10 % stronger: short circuit above 0.7085 */
    TEST_ASSERT_TRUE(at(0.72));
    in.psi_d_error = -6000;
    TEST_ASSERT_FALSE(at(0.691));
    TEST_ASSERT_TRUE(at(0.781));
}

void test_without_dc_voltage_any_rotation_is_shorted(void)
{
    in.v_dc = 0;
    TEST_ASSERT_TRUE(at(0.01));
    TEST_ASSERT_FALSE(at(0.0));
    in.v_dc = -100;
    TEST_ASSERT_TRUE(at(0.01));
}

/* e = 0.346 is the short circuit's level of v_dc = 0.385. The sensor fails, and the drive ends within a step. */
void test_a_dc_sensor_that_fails_does_not_short_a_machine_that_cannot_rectify(void)
{
    TEST_ASSERT_FALSE(at(0.5));
    in.v_dc = 0;
    TEST_ASSERT_FALSE(steps(1));
    in.doubtful = true;
    TEST_ASSERT_FALSE(steps(60000));
}

/* The link is really empty: with switching disabled the machine feeds it through the diodes, in 10 steps in a row. */
void test_a_current_through_the_diodes_confirms_a_low_dc_voltage(void)
{
    TEST_ASSERT_FALSE(at(0.5));
    in.v_dc = 9830;
    in.doubtful = true;
    in.rectifying = true;
    TEST_ASSERT_FALSE(steps(9));
    in.rectifying = false;
    TEST_ASSERT_FALSE(steps(1));
    in.rectifying = true;
    TEST_ASSERT_FALSE(steps(9));
    TEST_ASSERT_TRUE(steps(1));
}

/* From 0.6 to 0.4: the level of e = 0.416 is v_dc = 0.462, reached after 64 ln(0.2/0.062) = 75 steps. */
void test_without_a_fault_the_known_dc_voltage_falls_in_64_steps_and_rises_at_once(void)
{
    TEST_ASSERT_FALSE(at(0.6));
    in.v_dc = 13107;
    TEST_ASSERT_FALSE(steps(73));
    TEST_ASSERT_TRUE(steps(4));
    TEST_ASSERT_TRUE(steps(1000));
    TEST_ASSERT_EQUAL_INT16(13107, state.v_dc);
    in.v_dc = 19661;
    TEST_ASSERT_FALSE(steps(1));
    in.v_dc = 0;
    TEST_ASSERT_FALSE(steps(1));
    in.doubtful = true;
    in.v_dc = 22000;
    TEST_ASSERT_FALSE(steps(1));
    TEST_ASSERT_EQUAL_INT16(22000, state.v_dc);
}

void test_without_a_valid_speed_the_last_one_counts_and_the_lower_threshold_decides(void)
{
    TEST_ASSERT_FALSE(at(0.72)); /* between the thresholds */
    in.speed_valid = false;
    TEST_ASSERT_TRUE(at(0.0));
    setUp();
    TEST_ASSERT_FALSE(at(0.6));
    in.speed_valid = false;
    TEST_ASSERT_FALSE(at(0.99));
}

/* The known speed falls by 0.004 per step, including the rounding of the constant. */
void test_the_known_speed_falls_no_faster_than_a_rotor_and_rises_at_once(void)
{
    TEST_ASSERT_TRUE(at(0.95));
    in.omega = 0;
    TEST_ASSERT_TRUE(steps(20));
    TEST_ASSERT_DOUBLE_WITHIN(1e-3, 0.95 - 20.0 * 0.004, known());
    in.omega = INT16_MIN;
    (void)steps(1);
    TEST_ASSERT_EQUAL_INT16(INT16_MAX, state.speed);
}

/* A frozen angle is reported late or never: the currents of the short circuit show that the rotor turns. */
void test_in_the_short_circuit_a_frozen_angle_is_not_taken_for_standstill(void)
{
    TEST_ASSERT_TRUE(at(0.9));
    in.omega = 0;
    in.shorted = true;
    for (int k = 0; k < 5000; k++) {
        short_circuit_currents(1.0, 4.0 * k, 4.0 * k - 0.4);
        TEST_ASSERT_TRUE(steps(1));
    }
    TEST_ASSERT_DOUBLE_WITHIN(0.01, 0.9, known());
}

/* At exactly one turn per step the currents are the same in each step. Therefore those of two periods are compared. */
void test_a_frozen_angle_at_1_khz_is_seen_within_the_period(void)
{
    TEST_ASSERT_TRUE(at(0.9));
    in.omega = 0;
    in.shorted = true;
    short_circuit_currents(1.0, 0.3, 0.3 - 0.63);
    TEST_ASSERT_TRUE(steps(5000));
}

void test_constant_currents_confirm_the_speed(void)
{
    TEST_ASSERT_TRUE(at(0.9));
    in.shorted = true;
    short_circuit_currents(1.0, 0.3, 0.32);
    TEST_ASSERT_FALSE(at(0.5));
    TEST_ASSERT_DOUBLE_WITHIN(1e-3, 0.5, known());
}

/* Between two periods the currents may differ by less than an eighth, here 1000 of 8000. */
void test_currents_that_differ_by_an_eighth_within_a_period_confirm_nothing(void)
{
    for (int32_t change = 999; change <= 1000; change++) {
        setUp();
        TEST_ASSERT_TRUE(at(0.9));
        in.shorted = true;
        short_circuit_currents(1.0, 0.0, 0.0);
        in.i = (dq_q15_t){8000, 0};
        in.i_last_period = (dq_q15_t){8000 - change, 0};
        (void)at(0.5);
        TEST_ASSERT_DOUBLE_WITHIN(1e-3, (change == 999) ? 0.5 : 0.9, known());
    }
}

/* From step to step the currents may differ by less than a quarter: they rise by 1.3 here. */
void test_currents_that_differ_by_less_than_a_quarter_between_steps_confirm_the_speed(void)
{
    TEST_ASSERT_TRUE(at(0.9));
    in.shorted = true;
    in.omega = 0;
    short_circuit_currents(1.0, 0.0, 0.0);
    double current = 80.0;
    for (int k = 0; k < 21; k++) {
        current *= 1.3;
        in.i = in.i_last_period = (dq_q15_t){(int32_t)current, 0};
        (void)steps(1);
    }
    TEST_ASSERT_TRUE(known() < 0.897);
}

/* Constant currents before the short circuit show nothing: the 20 steps begin with it. */
void test_the_speed_is_confirmed_after_20_steps_of_the_short_circuit(void)
{
    short_circuit_currents(1.0, 0.3, 0.3);
    TEST_ASSERT_TRUE(at(0.9));
    in.shorted = true;
    in.omega = 0;
    (void)steps(19);
    TEST_ASSERT_DOUBLE_WITHIN(1e-3, 0.9, known());
    (void)steps(1);
    TEST_ASSERT_DOUBLE_WITHIN(1e-3, 0.896, known());
}

/* The currents contradict the angle: a higher speed counts, a lower one does not. */
void test_in_the_short_circuit_an_unconfirmed_speed_counts_only_if_it_is_higher(void)
{
    TEST_ASSERT_FALSE(at(0.5));
    in.shorted = true;
    in.omega = (q15_t)(0.7 * 32768.0);
    short_circuit_currents(1.0, 0.3, 2.0);
    (void)steps(1);
    TEST_ASSERT_DOUBLE_WITHIN(1e-3, 0.7, known());
    (void)at(0.2);
    TEST_ASSERT_DOUBLE_WITHIN(1e-3, 0.7, known());
}

/* The bridge is shorted below the speed that requires it: the currents turn, so the rotor turns. */
void test_without_an_angle_the_speed_does_not_fall_while_the_phases_are_shorted(void)
{
    TEST_ASSERT_FALSE(at(0.5));
    in.omega = 0;
    in.shorted = true;
    in.speed_valid = false;
    for (int k = 0; k < 30000; k++) {
        short_circuit_currents(1.0, 4.0 * k, 4.0 * k - 0.4);
        TEST_ASSERT_FALSE(steps(1));
    }
    TEST_ASSERT_DOUBLE_WITHIN(1e-3, 0.5, known());
}

/* Without a valid angle only the end of the currents shows that the rotor has stopped. */
void test_without_an_angle_the_short_circuit_lasts_until_its_currents_have_vanished(void)
{
    TEST_ASSERT_TRUE(at(0.9));
    in.omega = 29000; /* invalid: it does not count */
    in.shorted = true;
    in.speed_valid = false;
    short_circuit_currents(0.5, 0.3, 0.3);
    TEST_ASSERT_TRUE(steps(100000));
    short_circuit_currents(0.1, 0.3, 0.3);
    TEST_ASSERT_TRUE(steps(19));
    TEST_ASSERT_FALSE(steps(1));
    TEST_ASSERT_EQUAL_INT16(0, state.speed);
}

/* An eighth of psi_f is 1638. */
void test_currents_of_an_eighth_of_the_magnets_flux_are_no_standstill(void)
{
    for (int32_t psi = 1637; psi <= 1638; psi++) {
        setUp();
        TEST_ASSERT_TRUE(at(0.9));
        in.shorted = true;
        in.speed_valid = false;
        in.psi_current = (dq_q15_t){-psi, 0};
        TEST_ASSERT_EQUAL(psi == 1638, steps(1000));
    }
}

void test_wrong_currents_are_no_standstill(void)
{
    TEST_ASSERT_TRUE(at(0.9));
    in.shorted = true;
    in.speed_valid = in.currents_valid = false;
    TEST_ASSERT_TRUE(steps(30000));
    TEST_ASSERT_DOUBLE_WITHIN(1e-3, 0.9, known());
}

/* Not yet or no longer shorted although it is decided: an unknown speed that needs the short circuit does not fall. */
void test_an_unknown_speed_does_not_fall_while_the_short_circuit_is_needed(void)
{
    TEST_ASSERT_TRUE(at(0.9));
    in.speed_valid = false;
    TEST_ASSERT_TRUE(steps(30000));
    TEST_ASSERT_DOUBLE_WITHIN(1e-3, 0.9, known());
}

/* A valid speed begins the 20 s anew; their count does not wrap. */
void test_the_time_of_an_unknown_speed_begins_with_the_last_valid_one(void)
{
    for (int round = 0; round < 2; round++) {
        in.speed_valid = true;
        TEST_ASSERT_FALSE(at(0.6));
        in.speed_valid = false;
        (void)steps(19000);
        TEST_ASSERT_DOUBLE_WITHIN(1e-3, 0.6, known());
    }
    (void)steps(70000);
    TEST_ASSERT_EQUAL_UINT16(20000, state.unknown_steps);
}

void test_with_switching_disabled_an_unknown_speed_falls_after_20_s(void)
{
    TEST_ASSERT_FALSE(at(0.6));
    in.omega = 0;
    in.speed_valid = false;
    (void)steps(20000);
    TEST_ASSERT_DOUBLE_WITHIN(1e-4, 0.6, known());
    (void)steps(1);
    TEST_ASSERT_DOUBLE_WITHIN(1e-4, 0.596, known());
    (void)steps(199);
    TEST_ASSERT_EQUAL_INT16(0, state.speed);
}

/* With a current sensor that is known to be wrong the speed follows the angle alone: two independent faults are not
 * assumed. */
void test_wrong_currents_do_not_keep_the_speed_from_falling(void)
{
    TEST_ASSERT_TRUE(at(0.9));
    in.shorted = true;
    in.currents_valid = false;
    short_circuit_currents(1.0, 0.3, 2.0);
    TEST_ASSERT_FALSE(at(0.0));
}

enum { ANGLE_WORKS, ANGLE_FROZEN, ANGLE_FROZEN_AND_FLAGGED, ANGLES };

/* A machine that turns by `turn` rad per step at full speed and slows down by `fall` per step. Its short-circuit
 * current is w/sqrt(w^2 + r^2) of the largest. After `fault` steps a fault is latched and the safe state acts. */
static void model(double start, double fall, double turn, int angle, int fault)
{
    double w = start, theta = 0.0;
    bool short_circuit = false;
    setUp();
    (void)at(start);
    for (int k = 0; k < 1500; k++) {
        const double length = w / sqrt(w * w + 0.02 * 0.02);
        const double frame = (angle == ANGLE_WORKS) ? 0.0 : theta;
        short_circuit_currents(length, frame, frame - ((angle == ANGLE_WORKS) ? 0.0 : w * turn / 20.0));
        in.omega = (q15_t)((angle == ANGLE_WORKS) ? 32767.0 * w : 0.0);
        in.speed_valid = k < fault || angle != ANGLE_FROZEN_AND_FLAGGED;
        in.shorted = k > fault && short_circuit;
        short_circuit = safe_state_step(&config, &state, &in);
        const double e = sqrt(3.0) * 0.4 * w, limit = (angle == ANGLE_FROZEN) ? 0.91 : 0.81;
        if (e > limit * 0.6) {
            /* ecu/observe.c opens the contactor below 0.8 of the lowest dc voltage, which is 0.6 of the nominal one. */
            TEST_ASSERT_TRUE(state.line_emf > 0.8 * 0.6 * 0.6 * 32768.0);
        }
        theta += w * turn;
        w = fmax(w - fall, 0.0);
    }
}

/* The release of the contactor relies on this property: with any failure of the angle and any speed of the rotor, the
 * known line voltage stays above the release level while the true one could charge the dc link. */
void test_no_failure_of_the_angle_releases_a_machine_that_turns(void)
{
    static const double falls[] = {0.0, 0.0002, 0.001, 0.0039}, turns[] = {2.0, 4.0, 2.0 * 3.14159265 / 0.9, 12.0};
    for (int start = 4; start <= 99; start += 5) {
        for (int n = 0; n < 16; n++) {
            for (int angle = 0; angle < ANGLES; angle++) {
                model(start / 100.0, falls[n % 4], turns[n / 4], angle, 1 + n);
            }
        }
    }
}

void test_a_short_circuit_after_an_over_voltage_lasts_at_any_speed_until_the_voltage_is_low(void)
{
    in.over_voltage = true;
    in.v_dc = 28000;
    TEST_ASSERT_TRUE(at(0.0));
    in.v_dc = 24001;
    TEST_ASSERT_TRUE(at(0.0));
    in.v_dc = 24000;
    TEST_ASSERT_TRUE(steps(199));
    in.v_dc = 24001;
    TEST_ASSERT_TRUE(steps(1));
    in.v_dc = 24000;
    TEST_ASSERT_TRUE(steps(199));
    TEST_ASSERT_FALSE(steps(1));
    TEST_ASSERT_FALSE(steps(1000));
}

void test_no_argument_wraps(void)
{
    in.omega = INT16_MIN;
    in.psi_d_error = INT16_MAX;
    in.v_dc = INT16_MAX;
    TEST_ASSERT_TRUE(safe_state_step(&config, &state, &in));
}

/* The low voltage of the time before an over-voltage ends no short circuit after it. */
void test_only_a_voltage_that_is_low_after_the_over_voltage_releases(void)
{
    TEST_ASSERT_FALSE(steps(300));
    in.over_voltage = true;
    TEST_ASSERT_TRUE(steps(1));
}
