/* SPDX-License-Identifier: Apache-2.0 */
/* The 1 kHz task's part of commissioning: when it starts, and what it does with the measurement. The measurement itself
 * is tested in tests/unit/control. */
#include <math.h>

#include "drive/mrai/mrai_seam.h"
#include "hal/mock_adc.h"
#include "hal/mock_angle.h"
#include "hal/mock_irq.h"
#include "hal/mock_pwm.h"
#include "hal/mock_temperature.h"
#include "seam.h"
#include "unity.h"

#define ONE_Q30 1073741824.0
#define V_DC 21845 /* q15 */

#define KNEE 640.0       /* q15: twice the lowest level */
#define KNEE_Q17 6710886 /* 2^32 over it */

static snapshot_t snapshot;
static commission_state_t *const commission = &drive.task.commission;

void setUp(void)
{
    seam_start();
    snapshot = (snapshot_t){.sample = {.acting = true, .v_dc = V_DC}, .window = {.acting = true}};
    drive.task.run_state = RUN_STATE_RUN;
    identify_set(&drive.task.identify, IDENTIFY_DROP, 1000000);
}

void tearDown(void)
{
}

static void ask(void)
{
    drive.request.commissionings++;
    drive_commission(&drive, &snapshot);
}

static int dead_time(void)
{
    return drive.parameters.modulate.dead_time_q16 / 2;
}

/* A winding of r times the motor's resistance behind an inverter whose voltage error, per unit, rises linearly up to
 * the knee. */
typedef struct {
    double r, error, knee;
} inverter_t;

static double linear_up_to(double knee, double i)
{
    return (i < knee) ? i / knee : 1.0;
}

/* The d voltage per unit at a current in q15. The angle is zero, so that the cosines of the phases are 1, 1/2 and 1/2:
 * without a knee the error of the d voltage is 4/3 of a phase's. */
static double voltage(const inverter_t *inverter, double i)
{
    const modulate_config_t *c = &drive.parameters.modulate;
    const double compensated = c->dead_time_q16 / 65536.0 * V_DC / 32768.0;
    const double compensated_knee = 4294967296.0 / c->knee_q17;
    const double r_pu = inverter->r * motor.identify.r0 / (2.0 * ONE_Q30);
    double error = 0.0;
    for (int phase = 0; phase < 3; phase++) {
        const double c_x = (phase == 0) ? 1.0 : 0.5;
        error += 2.0 / 3.0 * c_x * inverter->error * linear_up_to(inverter->knee, c_x * i);
        if (inverter->knee > 0.0) { /* the error is the whole one, of which the modulation compensates a part */
            error -= 2.0 / 3.0 * c_x * compensated * linear_up_to(compensated_knee, c_x * i);
        }
    }
    return r_pu * i / 32768.0 + error;
}

/* Before the last step of the measurement, whose voltage is rounded to q15: 0.2 % of it. */
static void measured_with(inverter_t inverter)
{
    const commission_config_t *config = &motor.commission;
    *commission = (commission_state_t){.phase = COMMISSION_MEASURE,
                                       .steps = (uint16_t)(config->measure_steps - 1U),
                                       .index = 2U * COMMISSION_LEVELS - 1U};
    for (unsigned k = 0; k < COMMISSION_LEVELS; k++) {
        const double i = config->i_max * pow(2.0, -6.0 + 0.5 * k);
        const double u = voltage(&inverter, i);
        const double share = (k == COMMISSION_LEVELS - 1U) ? 0.5 : 1.0; /* the other polarity of the last one follows */
        commission->data.i[k] = (int32_t)lround(share * i * 32768.0);
        commission->data.u[k] = (int32_t)lround(share * u * ONE_Q30);
        commission->i_ref.d = -(int32_t)lround(i);
        snapshot.window.sum_i.d = config->periods_per_step * commission->i_ref.d;
        snapshot.window.sum_u.d = config->periods_per_step * -(int32_t)lround(u * 32768.0);
    }
    commission->sum_i = (config->measure_steps - 1) * snapshot.window.sum_i.d;
    commission->sum_u = (config->measure_steps - 1) * snapshot.window.sum_u.d;
}

/* Constant, and what is left behind the compensation. */
static void measured(double r, double error)
{
    measured_with((inverter_t){r, error, 0.0});
}

static void does_not_fit(void)
{
    const motor_parameters_t before = drive.parameters;
    drive_commission(&drive, &snapshot);
    TEST_ASSERT_EQUAL_INT(COMMISSION_FAILED, commission->phase);
    TEST_ASSERT_EQUAL_INT(COMMISSION_FIT, commission->failure);
    TEST_ASSERT_EQUAL_MEMORY(&before, &drive.parameters, sizeof before);
    TEST_ASSERT_EQUAL_INT32(1000000, drive.task.identify.kalman.x_q27[IDENTIFY_DROP]);
    setUp();
}

void test_it_starts_only_while_the_drive_runs_with_the_robust_identification(void)
{
    ask();
    TEST_ASSERT_EQUAL_INT(COMMISSION_SETTLE, commission->phase);
    for (int paper = 0; paper < 2; paper++) {
        setUp();
        drive.task.run_state = paper ? RUN_STATE_RUN : RUN_STATE_OFF;
        snapshot.mrai_is_chosen = paper;
        ask();
        TEST_ASSERT_EQUAL_INT(COMMISSION_FAILED, commission->phase);
        TEST_ASSERT_EQUAL_INT(COMMISSION_STOPPED, commission->failure);
    }
}

void test_a_sample_or_a_window_without_the_bridge_and_the_end_of_the_run_stop_it(void)
{
    for (int n = 0; n < 4; n++) {
        setUp();
        ask();
        snapshot.window.acting = n != 0;
        snapshot.sample.acting = n != 1;
        drive.task.run_state = (n != 2) ? RUN_STATE_RUN : RUN_STATE_OFF;
        drive_commission(&drive, &snapshot);
        TEST_ASSERT_EQUAL_INT((n == 3) ? COMMISSION_SETTLE : COMMISSION_FAILED, commission->phase);
    }
}

/* The monitor of the torque compares with a command that does not act: it begins anew afterwards. */
void test_while_it_runs_its_currents_are_the_reference_and_the_torque_is_not_monitored(void)
{
    seam_periods(3);
    drive.request.torque_arbitrated = 5000;
    seam_run();
    seam_periods(50);
    TEST_ASSERT_GREATER_THAN_INT(0, drive.task.i_ref.q);
    TEST_ASSERT_GREATER_THAN_UINT8(0, drive.task.torque_monitor.settling);
    drive.request.commissionings++;
    seam_periods(20);
    TEST_ASSERT_EQUAL_INT(COMMISSION_SETTLE, commission->phase);
    TEST_ASSERT_EQUAL_UINT8(0, drive.task.torque_monitor.settling);
    TEST_ASSERT_EQUAL_INT32(commission->i_ref.d, drive.task.i_ref.d);
    TEST_ASSERT_EQUAL_INT32(0, drive.task.i_ref.q);
}

/* What is left behind the compensation, as a share of the dc voltage, is added to it: 0.004 of 0.667 is 197 counts. */
void test_a_constant_error_is_added_to_the_compensation(void)
{
    const int before = dead_time();
    measured(1.0, 0.004);
    drive_commission(&drive, &snapshot);
    TEST_ASSERT_EQUAL_INT(COMMISSION_DONE, commission->phase);
    TEST_ASSERT_INT_WITHIN(4, before + 197, dead_time());
    TEST_ASSERT_EQUAL_INT32(0, drive.task.identify.kalman.x_q27[IDENTIFY_DROP]);
    TEST_ASSERT_EQUAL_INT32(1, drive.task.compensation.measured);
}

/* The window of the step in which it starts is older than its first current. */
void test_the_step_in_which_it_starts_does_not_count(void)
{
    ask();
    TEST_ASSERT_EQUAL_UINT16(0, commission->steps);
    drive_commission(&drive, &snapshot);
    TEST_ASSERT_EQUAL_UINT16(1, commission->steps);
}

void test_currents_and_voltages_of_the_window_are_measured(void)
{
    measured(1.0, 0.004);
    commission->steps = 0;
    commission->sum_i = 1000;
    commission->sum_u = 2000;
    drive_commission(&drive, &snapshot);
    TEST_ASSERT_EQUAL_INT32(1000 + snapshot.window.sum_i.d, commission->sum_i);
    TEST_ASSERT_EQUAL_INT32(2000 + snapshot.window.sum_u.d, commission->sum_u);
}

/* At 30 degrees sqrt(3)/2, sqrt(3)/2 and 0; some LSB for sine and transform. */
void test_the_cosines_are_those_of_the_measured_angle(void)
{
    measured(1.0, 0.004);
    snapshot.sample.theta_e = 0x15555555U;
    drive_commission(&drive, &snapshot);
    TEST_ASSERT_INT_WITHIN(8, 28378, commission->data.cosine[0]);
    TEST_ASSERT_INT_WITHIN(8, 28378, commission->data.cosine[1]);
    TEST_ASSERT_INT_WITHIN(8, 0, commission->data.cosine[2]);
}

static void fails_by(commission_failure_t failure)
{
    drive_commission(&drive, &snapshot);
    TEST_ASSERT_EQUAL_INT(COMMISSION_FAILED, commission->phase);
    TEST_ASSERT_EQUAL_INT(failure, commission->failure);
    setUp();
}

void test_a_rotor_that_turns_and_a_limited_voltage_end_it(void)
{
    measured(1.0, 0.004);
    snapshot.sample.point.omega = -motor.commission.omega_max - 1;
    fails_by(COMMISSION_MOVED);
    measured(1.0, 0.004);
    snapshot.window.limited = 1;
    fails_by(COMMISSION_LIMITED);
}

void test_without_an_end_of_the_measurement_nothing_changes(void)
{
    const int before = dead_time();
    drive_commission(&drive, &snapshot);
    TEST_ASSERT_EQUAL_INT(COMMISSION_IDLE, commission->phase);
    commission->phase = COMMISSION_DONE; /* of the commissioning before */
    drive_commission(&drive, &snapshot);
    TEST_ASSERT_EQUAL_INT(COMMISSION_DONE, commission->phase);
    measured(1.0, 0.004);
    commission->steps = 0;
    drive_commission(&drive, &snapshot);
    TEST_ASSERT_EQUAL_INT(COMMISSION_MEASURE, commission->phase);
    TEST_ASSERT_EQUAL_INT(before, dead_time());
}

/* Also after a measurement that fitted, whose curve is still there. */
void test_levels_that_do_not_rise_do_not_fit(void)
{
    for (int again = 0; again <= 1; again++) {
        if (again) {
            measured(1.0, 0.004);
            drive_commission(&drive, &snapshot);
            TEST_ASSERT_EQUAL_INT(COMMISSION_DONE, commission->phase);
            identify_set(&drive.task.identify, IDENTIFY_DROP, 1000000);
        }
        measured(1.0, 0.004);
        commission->data.i[4] = commission->data.i[3];
        does_not_fit();
    }
}

void test_a_resistance_below_half_or_above_three_times_that_of_the_motor_does_not_fit(void)
{
    measured(0.45, 0.004);
    does_not_fit();
    measured(3.1, 0.004);
    does_not_fit();
    measured(2.9, 0.004);
    drive_commission(&drive, &snapshot);
    TEST_ASSERT_EQUAL_INT(COMMISSION_DONE, commission->phase);
}

/* The compensation subtracts more than the inverter loses without it. */
void test_a_negative_voltage_error_does_not_fit(void)
{
    measured(1.0, -1.5 * (dead_time() / 32768.0) * (V_DC / 32768.0));
    does_not_fit();
}

/* 0.1 of 0.667 is 0.15 of the dc voltage. */
void test_an_error_of_more_than_an_eighth_of_the_dc_voltage_does_not_fit(void)
{
    measured(1.0, 0.1);
    does_not_fit();
}

/* A whole error of the compensated one (749 of 32768 of the dc voltage) that rises up to the same current: nothing is
 * left, and the curve is what is compensated. */
void test_the_curve_contains_what_is_compensated(void)
{
    const double compensated = dead_time() / 32768.0 * V_DC / 32768.0;
    drive.parameters.modulate.knee_q17 = KNEE_Q17;
    measured_with((inverter_t){1.0, compensated, KNEE});
    drive_commission(&drive, &snapshot);
    TEST_ASSERT_EQUAL_INT(COMMISSION_DONE, commission->phase);
    for (unsigned k = 0; k < COMMISSION_LEVELS; k++) {
        const double expected = compensated * linear_up_to(KNEE, drive.task.inverter.knot[k] / 32768.0);
        TEST_ASSERT_DOUBLE_WITHIN(0.01 * compensated, expected, drive.task.inverter.v[k] / ONE_Q30);
    }
    TEST_ASSERT_DOUBLE_WITHIN(0.01 * compensated, compensated, drive.task.inverter.level / ONE_Q30);
}

static double knee(void)
{
    return 4294967296.0 / drive.parameters.modulate.knee_q17;
}

/* The fit takes the error as constant below the lowest current, 320: the area below the level is that of a knee at
 * k - 320 * 320/k. A slow rise up to the sixth level is also a resistance, so that 5 % less is found. For 900 and 1000
 * these are 786 and 898, 1.23 and 1.40 times the nominal knee. */
void test_a_knee_that_is_wider_by_more_than_a_quarter_replaces_the_nominal_one(void)
{
    for (int wide = 0; wide <= 1; wide++) {
        setUp();
        drive.parameters.modulate.knee_q17 = KNEE_Q17;
        measured_with((inverter_t){1.0, 0.025, wide ? 1000.0 : 900.0});
        drive_commission(&drive, &snapshot);
        TEST_ASSERT_EQUAL_INT(COMMISSION_DONE, commission->phase);
        if (wide) {
            TEST_ASSERT_DOUBLE_WITHIN(0.05 * 898.0, 898.0, knee());
        } else {
            TEST_ASSERT_EQUAL_INT32(KNEE_Q17, drive.parameters.modulate.knee_q17);
        }
        TEST_ASSERT_EQUAL_INT32(drive.parameters.modulate.knee_q17, drive.task.compensation.knee_q17);
    }
}

/* Without compensation the measured knee does not depend on the nominal one, which is then chosen from it. */
void test_a_knee_that_is_wider_by_exactly_a_quarter_is_noise(void)
{
    int32_t measured_q17 = 0;
    for (int run = 0; run < 3; run++) {
        setUp();
        const int32_t nominal_q17 = (5 * measured_q17 + 2) / 4 + ((run == 2) ? 2 : 0);
        drive.parameters.modulate.dead_time_q16 = 0;
        drive.parameters.modulate.knee_q17 = (run == 0) ? motor.parameters.modulate.knee_q17 : nominal_q17;
        measured_with((inverter_t){1.0, 0.025, 800.0});
        drive_commission(&drive, &snapshot);
        TEST_ASSERT_EQUAL_INT(COMMISSION_DONE, commission->phase);
        measured_q17 = (run == 0) ? drive.parameters.modulate.knee_q17 : measured_q17;
        TEST_ASSERT_EQUAL_INT32((run == 1) ? nominal_q17 : measured_q17, drive.parameters.modulate.knee_q17);
    }
    TEST_ASSERT_LESS_THAN_INT32(motor.parameters.modulate.knee_q17, measured_q17);
}

/* The motor's knee at 64, and one at 1450, of which more than 1024 are measured. The winding's resistance is small,
 * because a part of the rise is taken for a resistance. */
void test_the_knee_becomes_at_most_sixteen_times_as_wide(void)
{
    measured_with((inverter_t){0.6, 0.025, 1450.0});
    drive_commission(&drive, &snapshot);
    TEST_ASSERT_EQUAL_INT(COMMISSION_DONE, commission->phase);
    TEST_ASSERT_EQUAL_INT32(motor.parameters.modulate.knee_q17 / 16, drive.parameters.modulate.knee_q17);
}

/* Q30 over q15 is q15. Without a compensation the level does not depend on the voltage. */
void test_the_compensation_is_the_rounded_ratio_of_the_error_and_the_dc_voltage(void)
{
    for (int32_t v_dc = 20000; v_dc < 20200; v_dc++) {
        setUp();
        drive.parameters.modulate.dead_time_q16 = 0;
        snapshot.sample.v_dc = v_dc;
        measured(1.0, 0.07);
        drive_commission(&drive, &snapshot);
        TEST_ASSERT_EQUAL_INT(COMMISSION_DONE, commission->phase);
        TEST_ASSERT_EQUAL_INT32((drive.task.inverter.level + v_dc / 2) / v_dc, dead_time());
    }
}

/* The bounds move to the fitted resistance, whose number in Q30 is half of that in Q31. A third of it must be whole. */
void test_exactly_half_or_three_times_the_resistance_does_not_fit(void)
{
    double of_motor = 1.0;
    int32_t r = 1;
    while (r % 3 != 0) {
        setUp();
        of_motor += 0.001;
        measured(of_motor, 0.004);
        drive_commission(&drive, &snapshot);
        r = drive.task.inverter.r;
    }
    const int32_t r0[] = {4 * r, 4 * r - 1, 2 * (r / 3), 2 * (r / 3) + 1};
    for (unsigned k = 0; k < sizeof r0 / sizeof r0[0]; k++) {
        setUp();
        measured(of_motor, 0.004);
        seam.motor.identify.r0 = r0[k];
        drive_commission(&drive, &snapshot);
        TEST_ASSERT_EQUAL_INT32(r, drive.task.inverter.r);
        TEST_ASSERT_EQUAL_INT((k % 2U == 0U) ? COMMISSION_FAILED : COMMISSION_DONE, commission->phase);
    }
}

void test_a_compensation_beyond_its_range_is_refused(void)
{
    static const compensation_t bad[] = {{-1, 1000, 1}, {4097, 1000, 1}, {0, 0, 1}, {0, -1, 1}, {0, 1 << 30, 1}};
    static const compensation_t good[] = {{0, 1, 1}, {4096, (1 << 30) - 1, 1}};
    const motor_parameters_t before = drive.parameters;
    for (unsigned k = 0; k < sizeof bad / sizeof bad[0]; k++) {
        TEST_ASSERT_FALSE(drive_compensate(&drive, &bad[k]));
        TEST_ASSERT_EQUAL_MEMORY(&before, &drive.parameters, sizeof before);
    }
    for (unsigned k = 0; k < sizeof good / sizeof good[0]; k++) {
        TEST_ASSERT_TRUE(drive_compensate(&drive, &good[k]));
        TEST_ASSERT_EQUAL_INT32(good[k].dead_time, dead_time());
        TEST_ASSERT_EQUAL_INT32(good[k].knee_q17, drive.parameters.modulate.knee_q17);
    }
}

/* sqrt(3)/2 of 1000000; the trim begins anew. */
void test_a_compensation_sets_both_knees_and_is_the_base_of_the_trim(void)
{
    drive.task.trim = (dead_time_trim_state_t){.base = 700, .trim = 49, .steps = 3};
    TEST_ASSERT_TRUE(drive_compensate(&drive, &(compensation_t){300, 1000000, 1}));
    TEST_ASSERT_INT32_WITHIN(1, 866025, drive.parameters.modulate.knee_side_q17);
    TEST_ASSERT_EQUAL_INT(300, drive.task.trim.base);
    TEST_ASSERT_EQUAL_INT(0, drive.task.trim.trim);
    TEST_ASSERT_EQUAL_UINT16(0, drive.task.trim.steps);
}

/* (MO-11) with 2000 of 32768 of dead time: 2 (0.48 - 0.06104)/(sqrt(3) 0.600444), squared, is 0.6491. */
void test_a_larger_dead_time_reduces_the_voltage_that_cannot_be_limited_and_a_smaller_one_keeps_it(void)
{
    drive_set_dead_time(&drive.parameters, 2000);
    TEST_ASSERT_DOUBLE_WITHIN(1e-4, 0.6491, drive.parameters.current_control.clear_q30 / ONE_Q30);
    const uint32_t reduced = drive.parameters.current_control.clear_q30;
    drive_set_dead_time(&drive.parameters, 0);
    TEST_ASSERT_EQUAL_UINT32(reduced, drive.parameters.current_control.clear_q30);
}

/* Two standard deviations of the identified drop, 0.002688 each, are pi/4 * 0.005376/0.6667 = 207.5 of 32768 of the dc
 * voltage, of which the first second transfers a sixteenth, rounded up: 13. These are 4/pi * 13/32768 * 0.6667 = 0.1253
 * standard deviations. */
static void expect_trim(int lsb)
{
    const int before = dead_time();
    identify_state_t *const state = &drive.task.identify;
    identify_set(state, IDENTIFY_DROP, 2 << 27);
    state->kalman.p_q30[kalman_p_index(IDENTIFY_DROP, IDENTIFY_DROP)] = 1 << 27;
    drive.task.trim = (dead_time_trim_state_t){.base = (q15_t)before, .steps = (uint16_t)(motor.trim_steps - 1U)};
    drive_trim(&drive, V_DC);
    TEST_ASSERT_EQUAL_INT(before + lsb, dead_time());
    TEST_ASSERT_DOUBLE_WITHIN(1e-3, 2.0 - lsb * 0.1253 / 13.0, state->kalman.x_q27[IDENTIFY_DROP] / 134217728.0);
}

static void may_trim(void)
{
    setUp();
    drive.request.trim = true;
    drive.task.identify.kept.update_valid = true;
    drive.task.identify.kept.mismatch_share = Q15(0.25);
}

void test_the_identified_drop_moves_into_the_compensation_by_a_sixteenth_in_a_second(void)
{
    may_trim();
    expect_trim(13);
}

void test_the_drop_stays_without_a_request_a_valid_update_or_agreement_with_the_model(void)
{
    may_trim();
    drive.request.trim = false;
    expect_trim(0);
    may_trim();
    drive.task.identify.kept.update_valid = false;
    expect_trim(0);
    may_trim();
    drive.task.identify.kept.mismatch_share++;
    expect_trim(0);
}
