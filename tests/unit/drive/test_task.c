/* SPDX-License-Identifier: Apache-2.0 */
#include "drive/data_check.h"
#include "drive/excess_torque.h"
#include "drive/mrai/mrai_seam.h"
#include "drive/mrai/schedule_box.h"
#include "drive/safe_decision.h"
#include "drive/slow_monitors.h"
#include "drive/tracked_speed.h"
#include "hal/mock_adc.h"
#include "hal/mock_angle.h"
#include "hal/mock_irq.h"
#include "hal/mock_pwm.h"
#include "hal/mock_temperature.h"
#include "seam.h"
#include "unity.h"

void setUp(void)
{
    seam_start();
    seam_periods(3); /* until a sample with 350 V has been published */
    /* The samples of these tests are not those of a machine: the monitors would report faults. */
    seam.motor.plausibility.e_0 = INT16_MAX;
    seam.motor.plausibility.i_alive = INT16_MAX;
    seam.motor.torque_monitor.v_0 = INT16_MAX;
}

void tearDown(void)
{
}

static const command_t *command(void)
{
    return &drive.commands.slot[drive.commands.generation & 1U];
}

static const mrai_schedule_t *schedule(void)
{
    return &drive.mrai.schedules.slot[drive.mrai.schedules.generation & 1U];
}

/* The fast ISR of the next period carries out the command of the task. */
static void task_and_period(void)
{
    task_1khz(&drive);
    seam_period();
}

void test_the_shipped_motor_is_valid_and_starts_off(void)
{
    TEST_ASSERT_EQUAL_INT(MOTOR_CHECK_OK, drive_motor_check(&drive));
    TEST_ASSERT_EQUAL_HEX32(0, drive.fast.faults);
    static drive_t other;
    drive_init(&other, &motor);
    TEST_ASSERT_EQUAL_INT(Q15_MAX, other.task.reference.psi_plan); /* no field weakening before the first step */
    task_1khz(&drive);
    TEST_ASSERT_EQUAL_INT(RUN_STATE_OFF, drive.task.run_state);
    TEST_ASSERT_FALSE(command()->run);
}

void test_enable_runs_and_disable_stops(void)
{
    seam_run();
    TEST_ASSERT_EQUAL_INT(RUN_STATE_RUN, drive.task.run_state);
    TEST_ASSERT_TRUE(command()->run);
    drive.request.enable = false;
    task_1khz(&drive);
    TEST_ASSERT_EQUAL_INT(RUN_STATE_OFF, drive.task.run_state);
    TEST_ASSERT_FALSE(command()->run);
}

void test_a_fault_is_reset_only_while_enable_is_off(void)
{
    seam_run();
    drive_raise_fault(&drive, FAULT_OVER_CURRENT);
    task_1khz(&drive);
    TEST_ASSERT_EQUAL_INT(RUN_STATE_FAULT, drive.task.run_state);
    TEST_ASSERT_FALSE(command()->run);
    drive.request.fault_resets++; /* refused, and not kept for later */
    task_and_period();
    drive.request.enable = false;
    task_and_period();
    TEST_ASSERT_EQUAL_INT(RUN_STATE_FAULT, drive.task.run_state);
    TEST_ASSERT_EQUAL_HEX32(FAULT_OVER_CURRENT, drive.fast.faults);
    drive.request.fault_resets++;
    task_and_period();
    TEST_ASSERT_EQUAL_HEX32(0, drive.fast.faults);
    task_and_period();
    TEST_ASSERT_EQUAL_INT(RUN_STATE_OFF, drive.task.run_state);
}

void test_a_fault_that_persists_is_latched_again_at_once(void)
{
    seam_run();
    seam.counts.i_a = 4095;
    task_and_period();
    TEST_ASSERT_EQUAL_HEX32(FAULT_OVER_CURRENT, drive.fast.faults & FAULT_OVER_CURRENT);
    drive.request.enable = false;
    drive.request.fault_resets++;
    task_and_period();
    TEST_ASSERT_EQUAL_HEX32(FAULT_OVER_CURRENT, drive.fast.faults & FAULT_OVER_CURRENT);
}

void test_bad_motor_data_are_a_fault_that_no_reset_removes(void)
{
    static motor_t bad;
    bad = motor;
    bad.monitor.i_trip = 26215; /* 0.8 of full scale: the converter could saturate before the trip */
    drive_init(&drive, &bad);
    TEST_ASSERT_EQUAL_HEX32(FAULT_CONFIG, drive.fast.faults);
    drive.request.fault_resets++;
    task_and_period();
    TEST_ASSERT_EQUAL_HEX32(FAULT_CONFIG, drive.fast.faults);
    TEST_ASSERT_EQUAL_INT(MOTOR_CHECK_OVER_CURRENT_LEVEL, drive_motor_check(&drive));
    seam_run();
    TEST_ASSERT_EQUAL_INT(RUN_STATE_FAULT, drive.task.run_state);
}

static void calibrate_slew(q15_t slew)
{
    drive.parameters.torque_slew = slew;
    data_check_start(&drive); /* on purpose */
}

void test_the_torque_request_is_limited_and_slewed(void)
{
    calibrate_slew(100);
    drive.request.torque_arbitrated = INT16_MAX;
    seam_run();
    TEST_ASSERT_EQUAL_INT(100, drive.task.torque_commanded);
    task_1khz(&drive);
    TEST_ASSERT_EQUAL_INT(200, drive.task.torque_commanded);
    for (int n = 0; n < 500; n++) {
        task_1khz(&drive);
    }
    TEST_ASSERT_EQUAL_INT(motor.torque_max, drive.task.torque_commanded);
    calibrate_slew(Q15_MAX);
    drive.request.torque_arbitrated = INT16_MIN;
    task_1khz(&drive);
    TEST_ASSERT_EQUAL_INT(-motor.torque_max, drive.task.torque_commanded);
}

/* A falling limit reduces the torque in the same step, in both directions and at the slowest slew rate. */
void test_a_falling_limit_acts_at_once_with_any_calibrated_slew(void)
{
    for (int sign = -1; sign <= 1; sign += 2) {
        calibrate_slew(Q15_MAX);
        drive.request.limits = TORQUE_LIMITS_NONE;
        drive.request.torque_arbitrated = (q15_t)(sign * INT16_MAX);
        seam_run();
        task_1khz(&drive);
        TEST_ASSERT_EQUAL_INT(sign * motor.torque_max, drive.task.torque_commanded);
        calibrate_slew(0);
        drive.request.limits.torque_drive = 1000;
        drive.request.limits.torque_regen = 1000;
        task_1khz(&drive);
        TEST_ASSERT_EQUAL_INT(sign * 1000, drive.task.torque_commanded);
        drive.request.limits = TORQUE_LIMITS_NONE;
        task_1khz(&drive);
        TEST_ASSERT_EQUAL_INT(sign * 1000, drive.task.torque_commanded); /* a rise is slewed */
    }
}

void test_stopping_resets_the_slew_and_the_correction(void)
{
    drive.request.torque_arbitrated = 5000;
    seam_run();
    drive.task.torque_loop.correction = 300000000;
    drive.request.enable = false;
    task_1khz(&drive);
    TEST_ASSERT_EQUAL_INT(0, drive.task.torque_commanded);
    TEST_ASSERT_EQUAL_INT32(0, drive.task.torque_loop.correction);
    TEST_ASSERT_EQUAL_INT(0, drive.task.reference.i_ref.q);
}

void test_the_target_of_the_command_is_the_flux_of_the_current_reference(void)
{
    drive.request.torque_arbitrated = 5000;
    seam_run();
    const dq_q15_t i = drive.task.reference.i_ref;
    TEST_ASSERT_GREATER_THAN_INT(0, i.q);
    TEST_ASSERT_LESS_THAN_INT(0, i.d);
    const flux_point_t at = flux_table_step(&motor.flux_table, i);
    TEST_ASSERT_EQUAL_INT(at.psi_d, command()->target.psi.d);
    TEST_ASSERT_EQUAL_INT(at.psi_q, command()->target.psi.q);
}

void test_in_current_mode_the_requested_currents_are_the_target(void)
{
    drive.request.torque_arbitrated = 5000;
    drive.request.current_mode = true;
    drive.request.i_ref = (dq_q15_t){-1000, -2000};
    seam_run();
    const flux_point_t at = flux_table_step(&motor.flux_table, (dq_q15_t){-1000, -2000});
    TEST_ASSERT_EQUAL_INT(at.psi_d, command()->target.psi.d);
    TEST_ASSERT_EQUAL_INT(at.psi_q, command()->target.psi.q);
}

/* The torque does not follow the request in current mode: the torque loop must not integrate the difference. */
void test_in_current_mode_the_torque_loop_does_not_wind_up(void)
{
    drive.request.torque_arbitrated = 5000;
    drive.request.current_mode = true;
    seam_run();
    for (int n = 0; n < 1000; n++) {
        task_1khz(&drive);
    }
    TEST_ASSERT_EQUAL_INT32(0, drive.task.torque_loop.correction);
}

void test_the_torque_loop_can_be_switched_off(void)
{
    drive.request.identification_mode = IDENTIFICATION_PAPER; /* its confidence is high at once */
    drive.request.torque_arbitrated = 5000;
    drive.request.torque_loop = false;
    seam_run();
    for (int n = 0; n < 100; n++) {
        task_1khz(&drive);
    }
    TEST_ASSERT_EQUAL_INT(5000, drive.task.torque_corrected);
    drive.request.torque_loop = true;
    for (int n = 0; n < 100; n++) {
        task_1khz(&drive);
    }
    TEST_ASSERT_GREATER_THAN_INT(5000, drive.task.torque_corrected); /* the estimate is 0, so the loop adds torque */
}

static void sample_at(double omega_pu, bool acting, bool limited)
{
    sample_t *s = sample_box_begin(&drive.samples);
    *s = (sample_t){.point = {.i = {-3000, 5000}, .omega = (q31_t)(omega_pu * 2147483647.0)},
                    .v_dc = 21238,
                    .acting = acting,
                    .voltage_limited = limited};
    s->point.flux = flux_table_step(&motor.flux_table, s->point.i);
    sample_box_publish(&drive.samples);
    drive.fast.command_seen++; /* as the fast ISR does with each window */
    seam.gates = true;
}

void test_the_papers_law_adapts_only_while_the_bridge_acts_and_identification_is_requested(void)
{
    drive.request.identification_mode = IDENTIFICATION_PAPER;
    seam_run();
    sample_at(0.3, false, false);
    task_1khz(&drive);
    TEST_ASSERT_EQUAL_INT32(0, schedule()->flux_step_q28);
    sample_at(0.3, true, false);
    task_1khz(&drive);
    TEST_ASSERT_NOT_EQUAL(0, schedule()->flux_step_q28);
    drive.request.identification = false;
    task_1khz(&drive);
    TEST_ASSERT_EQUAL_INT32(0, schedule()->flux_step_q28);
}

void test_the_voltage_limit_holds_the_torque_loop(void)
{
    drive.request.identification_mode = IDENTIFICATION_PAPER;
    drive.request.torque_arbitrated = 5000;
    seam_run();
    sample_at(0.3, true, true);
    drive.task.torque_loop = (torque_loop_state_t){.model = 5000 * 65536};
    for (int n = 0; n < 100; n++) {
        task_1khz(&drive);
    }
    TEST_ASSERT_EQUAL_INT32(0, drive.task.torque_loop.correction);
    sample_at(0.3, true, false);
    task_1khz(&drive);
    TEST_ASSERT_GREATER_THAN_INT32(0, drive.task.torque_loop.correction);
}

/* Planned at a tracked speed that has changed by so much since the last step. */
static q15_t planned_flux(double omega_pu, double change_pu)
{
    setUp();
    drive.request.torque_arbitrated = 5000;
    seam_run();
    sample_at(omega_pu, true, false);
    drive.task.torque_monitor.omega = (q15_t)((omega_pu - change_pu) * 32768.0);
    task_1khz(&drive);
    return drive.task.reference.psi_plan;
}

/* At 0.5 of the speed base: a lag of 1/64 does not matter, and more than 1/16 is no rotor's. 6.6 steps. */
void test_the_voltage_is_planned_for_the_speed_of_the_rotor_where_the_tracked_one_is_far_behind(void)
{
    for (int sign = -1; sign <= 1; sign += 2) {
        const q15_t steady = planned_flux(sign * 0.5, 0.0);
        TEST_ASSERT_EQUAL_INT(steady, planned_flux(sign * 0.5, sign * 0.0015));
        TEST_ASSERT_EQUAL_INT(steady, planned_flux(sign * 0.5, sign * -0.006));
        TEST_ASSERT_EQUAL_INT(steady, planned_flux(sign * 0.5, sign * 0.02));
        const double more = 0.006 * 6.6 - 0.5 / 32.0;
        TEST_ASSERT_INT_WITHIN(100, (int)(steady * 0.5 / (0.5 + more)), planned_flux(sign * 0.5, sign * 0.006));
    }
}

static void have_torque(int commanded, int model, int estimated)
{
    drive.task.torque_commanded = (q15_t)commanded;
    drive.task.torque_loop.model = model * 65536;
    drive.task.identification.torque_estimated = (q15_t)estimated;
}

/* 10 % too much: counted once, in field weakening from the fifth step on 10 % - 1 % three times more. */
void test_too_much_torque_counts_fourfold_in_field_weakening_until_it_ends(void)
{
    for (int sign = -1; sign <= 1; sign += 2) {
        drive.task.excessive = 0;
        drive.task.voltage_reserve.trim = 32767; /* rounds to zero */
        have_torque(sign * 10000, sign * 10000, sign * 11000);
        for (int n = 0; n < 20; n++) {
            TEST_ASSERT_EQUAL_INT(sign * 11000, excess_torque_estimate(&drive));
        }
        drive.task.voltage_reserve.trim = sign * 65536;
        for (int n = 1; n <= 20; n++) { /* in the fifth step 3 % are still tolerated */
            const int expected = (n < 5) ? 11000 : ((n == 5) ? 13100 : 13700);
            TEST_ASSERT_INT_WITHIN(3, sign * expected, excess_torque_estimate(&drive));
        }
        have_torque(sign * 10000, sign * 10000, sign * 10200); /* 2 %: too little to begin, too much to end */
        TEST_ASSERT_INT_WITHIN(3, sign * 10500, excess_torque_estimate(&drive));
        have_torque(sign * 10000, sign * 10000, sign * 10090);
        TEST_ASSERT_EQUAL_INT(sign * 10090, excess_torque_estimate(&drive));
        TEST_ASSERT_EQUAL_UINT8(0, drive.task.excessive);
        have_torque(sign * 10000, sign * 10000, sign * 11000);
        TEST_ASSERT_EQUAL_INT(sign * 11000, excess_torque_estimate(&drive));
        drive.task.voltage_reserve.trim = 0; /* the next field weakening counts anew */
        (void)excess_torque_estimate(&drive);
        TEST_ASSERT_EQUAL_UINT8(0, drive.task.excessive);
    }
}

/* A torque that falls is not too much: the model is ahead of the estimate by as much as the command is ahead of it. */
void test_a_torque_that_follows_a_falling_command_is_not_too_much(void)
{
    drive.task.voltage_reserve.trim = 65536;
    for (int n = 0; n < 20; n++) {
        have_torque(9000, 10000, 11200);
        TEST_ASSERT_EQUAL_INT(11200, excess_torque_estimate(&drive));
    }
}

static int32_t far_behind(double omega_pu, int32_t lag)
{
    const snapshot_t snapshot = {.sample = {.point = {.omega = (q31_t)(omega_pu * 2147483648.0)}}, .lag = (q15_t)lag};
    return tracked_speed_far_behind(&snapshot);
}

/* A 32nd of the speed, at least of 4096 counts, is not far; more than 2048 counts are no rotor's lag. */
void test_the_lag_of_the_speed_counts_between_its_bounds_to_a_count(void)
{
    for (int sign = -1; sign <= 1; sign += 2) {
        TEST_ASSERT_EQUAL_INT32(0, far_behind(0.0, sign * 128));
        TEST_ASSERT_EQUAL_INT32(sign, far_behind(0.125, sign * 129));
        TEST_ASSERT_EQUAL_INT32(0, far_behind(0.25, sign * 256));
        TEST_ASSERT_EQUAL_INT32(sign, far_behind(-0.25, sign * 257));
        TEST_ASSERT_EQUAL_INT32(sign * (2048 - 128), far_behind(0.0, sign * 2048));
        TEST_ASSERT_EQUAL_INT32(0, far_behind(0.0, sign * 2049));
    }
}

/* At standstill the positive direction counts. */
void test_the_planned_speed_is_never_smaller_than_the_tracked_one(void)
{
    const snapshot_t forward = {.lag = 200}, backward = {.lag = -200};
    TEST_ASSERT_EQUAL_INT(72, tracked_speed_planned(&forward));
    TEST_ASSERT_EQUAL_INT(0, tracked_speed_planned(&backward));
}

/* 3 % of 10,000 are 300 counts, 1 % are 100; without a commanded torque the positive direction counts, and the least
 * torque is that of the loop. */
void test_torque_is_too_much_from_a_count_beyond_its_tolerance_on(void)
{
    static const struct {
        int commanded, estimated;
        uint8_t before, after;
    } cases[] = {{10000, 10300, 0, 0}, {10000, 10301, 0, 1}, {-10000, -10300, 0, 0}, {-10000, -10301, 4, 5},
                 {10000, 10300, 4, 0}, {10000, 10101, 5, 5}, {-10000, -10101, 5, 5}, {-10000, -10100, 5, 0},
                 {10000, 10100, 5, 0}, {0, 5000, 0, 1},      {0, -5000, 0, 0}};
    drive.task.voltage_reserve.trim = 65536;
    for (unsigned n = 0; n < sizeof cases / sizeof cases[0]; n++) {
        drive.task.excessive = cases[n].before;
        have_torque(cases[n].commanded, cases[n].commanded, cases[n].estimated);
        (void)excess_torque_estimate(&drive);
        TEST_ASSERT_EQUAL_UINT8(cases[n].after, drive.task.excessive);
    }
    const int least = (int)(0.03 * drive.parameters.torque_loop.torque_min + 0.5);
    drive.task.excessive = 0;
    have_torque(1, 1, 1 + least);
    (void)excess_torque_estimate(&drive);
    TEST_ASSERT_EQUAL_UINT8(0, drive.task.excessive);
    have_torque(1, 1, 2 + least);
    (void)excess_torque_estimate(&drive);
    TEST_ASSERT_EQUAL_UINT8(1, drive.task.excessive);
}

/* Steps in a row of which the monitor of a frozen angle says that the angle stands still. The angles at all of them are
 * alike: so they are at standstill, and where the field makes whole turns in a step. */
static int steps_of_a_standing_angle(double omega_pu)
{
    const snapshot_t snapshot = {
        .sample = {.acting = true, .point = {.omega = (q31_t)(omega_pu * 2147483648.0)}},
        .window = {.acting = true},
    };
    for (int n = 0; n < 8; n++) {
        (void)slow_monitors_step(&drive, &snapshot);
    }
    return drive.task.frozen_angle.standing;
}

void test_equal_angles_of_whole_turns_are_no_standstill(void)
{
    seam.motor.identify.window_turns_q29 = 4U << 29; /* at the speed base */
    for (int sign = -1; sign <= 1; sign += 2) {
        TEST_ASSERT_GREATER_THAN_INT(4, steps_of_a_standing_angle(sign * 0.06)); /* below a quarter of a turn */
        TEST_ASSERT_EQUAL_INT(0, steps_of_a_standing_angle(sign * 0.25));
        TEST_ASSERT_EQUAL_INT(0, steps_of_a_standing_angle(sign * 0.999)); /* four turns */
    }
}

/* Switching has been enabled, and the sample is from before. */
void test_a_sample_from_before_the_bridge_acted_is_no_part_of_a_standing_angle(void)
{
    snapshot_t snapshot = {.sample = {.acting = true}, .window = {.acting = true}};
    seam.motor.identify.window_turns_q29 = 4U << 29;
    for (int n = 0; n < 8; n++) {
        (void)slow_monitors_step(&drive, &snapshot);
    }
    TEST_ASSERT_GREATER_THAN_INT(4, drive.task.frozen_angle.standing);
    snapshot.sample.acting = false;
    (void)slow_monitors_step(&drive, &snapshot);
    TEST_ASSERT_EQUAL_INT(0, drive.task.frozen_angle.standing);
}

/* The comparison of a launch is kept as it is until the angle is that of the sensor again, or the bridge is off. */
void test_the_power_of_a_launch_is_not_compared_while_a_prediction_replaces_the_angle(void)
{
    snapshot_t snapshot = {.sample = {.acting = true, .theta_m = 1000000U}, .window = {.acting = true}};
    snapshot.sample.theta_e = 3U * snapshot.sample.theta_m + seam.motor.angle_tracker.offset;
    for (int n = 0; n < 4; n++) {
        (void)slow_monitors_step(&drive, &snapshot);
    }
    TEST_ASSERT_EQUAL_INT(3, drive.task.launch_power.steady);
    snapshot.sample.theta_e += 1U;
    (void)slow_monitors_step(&drive, &snapshot);
    snapshot.sample.theta_e -= 1U;
    (void)slow_monitors_step(&drive, &snapshot); /* its change of the angle is not that of one step */
    TEST_ASSERT_EQUAL_INT(3, drive.task.launch_power.steady);
    (void)slow_monitors_step(&drive, &snapshot);
    TEST_ASSERT_EQUAL_INT(4, drive.task.launch_power.steady);
    snapshot.sample.theta_e += 1U;
    snapshot.sample.acting = false;
    (void)slow_monitors_step(&drive, &snapshot);
    TEST_ASSERT_EQUAL_INT(0, drive.task.launch_power.steady);
}

/* A sample off its reference is none of a broken lead while the mean of the step is near it. */
void test_the_power_of_a_launch_is_compared_while_sample_or_mean_of_the_current_follow_the_reference(void)
{
    const q15_t off = (q15_t)(2 * seam.motor.torque_monitor.i_0);
    snapshot_t snapshot = {.sample = {.acting = true, .point = {.i = {off, 0}}}, .window = {.acting = true}};
    snapshot.sample.theta_e = seam.motor.angle_tracker.offset;
    for (int n = 0; n < 4; n++) {
        (void)slow_monitors_step(&drive, &snapshot);
    }
    TEST_ASSERT_EQUAL_INT(3, drive.task.launch_power.steady);
    snapshot.i_mean.d = off;
    (void)slow_monitors_step(&drive, &snapshot);
    TEST_ASSERT_EQUAL_INT(0, drive.task.launch_power.steady);
}

/* A constant current out of phase a, for 60 steps at this speed; whether the upper switches are commanded then. */
static bool upper_after_constant_current(double omega_pu, bool acting, bool shorted)
{
    const snapshot_t snapshot = {
        .sample = {.acting = acting, .i_ab = fx_pair(3000, 0), .point = {.omega = (q31_t)(omega_pu * 2147483648.0)}},
        .shorted = shorted,
    };
    for (int n = 0; n < 60; n++) {
        (void)slow_monitors_step(&drive, &snapshot);
    }
    sample_at(omega_pu, acting, false);
    task_1khz(&drive);
    return command()->upper;
}

/* A whole turn in a step makes the second harmonic of a half wave constant at both samples of the step. */
void test_a_constant_current_commands_the_upper_switches_unless_it_may_be_a_harmonic(void)
{
    seam_run();
    seam.motor.identify.window_turns_q29 = 1U << 30; /* two turns at the speed base */
    for (int sign = -1; sign <= 1; sign += 2) {
        TEST_ASSERT_TRUE(upper_after_constant_current(0.1 * sign, true, false));
        TEST_ASSERT_FALSE(upper_after_constant_current(0.01 * sign, true, false));
        TEST_ASSERT_TRUE(upper_after_constant_current(0.48 * sign, true, false));
        TEST_ASSERT_FALSE(upper_after_constant_current(0.49 * sign, true, false));
        TEST_ASSERT_FALSE(upper_after_constant_current(0.51 * sign, true, false));
        TEST_ASSERT_TRUE(upper_after_constant_current(0.52 * sign, true, false));
    }
}

/* At half a turn in a step the second harmonic has the opposite value half a step before. */
void test_a_harmonic_that_turns_once_in_a_step_is_no_constant_current(void)
{
    seam_run();
    seam.motor.identify.window_turns_q29 = 1U << 30;
    for (uint32_t n = 0; n < SAMPLE_SLOTS; n++) {
        sample_t *s = sample_box_begin(&drive.samples);
        *s = (sample_t){.i_ab = fx_pair(-3000, 0), .acting = true};
        sample_box_publish(&drive.samples);
    }
    TEST_ASSERT_FALSE(upper_after_constant_current(0.25, true, false));
    TEST_ASSERT_INT_WITHIN(60, 0, drive.task.short_side.a_q8 / 256);
}

/* Switching is disabled before the short circuit begins: what was decided before the fault counts. */
void test_the_side_of_the_short_circuit_is_kept_while_a_fault_is_latched(void)
{
    seam_run();
    seam.motor.identify.window_turns_q29 = 1U << 29;
    TEST_ASSERT_TRUE(upper_after_constant_current(0.1, true, false));
    const snapshot_t off = {.faults = FAULT_CONTROL}, reset = {.faults = 0};
    (void)slow_monitors_step(&drive, &off);
    TEST_ASSERT_TRUE(safe_decision_is_upper(&drive));
    (void)slow_monitors_step(&drive, &reset);
    TEST_ASSERT_FALSE(safe_decision_is_upper(&drive));
}

/* Leaving torque at speed. */

/* hsm1: the short circuit is the safe state above 0.77 of the speed base, which is 10 500 rpm. */
static void run_at(double omega_pu, double torque_pu)
{
    slow_monitors_without_machine(&seam.motor);
    seam_run();
    drive.parameters.torque_slew = Q15_MAX;
    data_check_start(&drive);
    drive.request.torque_arbitrated = (q15_t)(torque_pu * 32768.0);
    for (int n = 0; n < 50; n++) {
        sample_at(omega_pu, true, false);
        task_1khz(&drive);
    }
}

/* The record of what was identified is being written. */
void test_switching_waits_while_the_drive_is_held(void)
{
    drive_hold(&drive, true);
    seam_run();
    TEST_ASSERT_FALSE(command()->run);
    drive_hold(&drive, false);
    task_1khz(&drive);
    TEST_ASSERT_TRUE(command()->run);
}

/* Without the absolute angle the torque could have any sign. */
void test_switching_waits_for_the_absolute_angle(void)
{
    seam.angle_unknown = true;
    drive.request.enable = true;
    for (int n = 0; n < 100; n++) {
        sample_at(0.1, false, false);
        task_1khz(&drive);
        TEST_ASSERT_EQUAL_INT(RUN_STATE_OFF, drive.task.run_state);
        TEST_ASSERT_FALSE(command()->run);
    }
    seam.angle_unknown = false;
    task_1khz(&drive);
    TEST_ASSERT_TRUE(command()->run);
}

void test_enable_off_at_speed_holds_the_torque_at_zero_until_switching_can_be_disabled(void)
{
    for (int sign = -1; sign <= 1; sign += 2) {
        setUp();
        run_at(0.9 * sign, 0.1);
        drive.parameters.torque_slew = 1; /* of no account when the torque has to go */
        data_check_start(&drive);
        TEST_ASSERT_GREATER_THAN_INT(2000, drive.task.torque_commanded);
        drive.request.enable = false;
        for (int n = 0; n < 1000; n++) {
            sample_at(0.9 * sign, true, false);
            task_1khz(&drive);
            TEST_ASSERT_EQUAL_INT(RUN_STATE_RUN, drive.task.run_state);
            TEST_ASSERT_TRUE(command()->run);
            TEST_ASSERT_TRUE(n < 10 || drive.task.torque_commanded == 0);
        }
        TEST_ASSERT_INT_WITHIN(300, 0, drive.task.i_ref.q);
        TEST_ASSERT_LESS_THAN_INT(0, drive.task.i_ref.d); /* field weakening goes on */
        for (int n = 0; n < 200; n++) {
            sample_at(0.5 * sign, true, false);
            task_1khz(&drive);
        }
        TEST_ASSERT_EQUAL_INT(RUN_STATE_OFF, drive.task.run_state);
        TEST_ASSERT_FALSE(command()->run);
    }
}

/* Enable goes off below the level, and in that step the speed exceeds it. The short circuit closed onto a bridge
 * without current would drive twice its lasting current. */
void test_a_level_that_is_exceeded_in_the_step_of_switching_off_closes_no_short_circuit(void)
{
    run_at(0.7, 0.0);
    TEST_ASSERT_FALSE(drive.task.safe_state.short_circuit);
    drive.request.enable = false;
    sample_at(0.9, true, false);
    task_1khz(&drive);
    TEST_ASSERT_TRUE(drive.task.safe_state.short_circuit);
    TEST_ASSERT_EQUAL_INT(RUN_STATE_OFF, drive.task.run_state);
    TEST_ASSERT_EQUAL_INT(SAFE_FREEWHEEL, command()->safe);
}

/* Steps of the task with a sensor of the dc voltage that reads nothing, and a current that flows with this i_q. */
static safe_t safe_without_dc_reading(int32_t i_q, int steps)
{
    for (int k = 0; k < steps; k++) {
        sample_t *s = sample_box_begin(&drive.samples);
        *s = *sample_box_at(&drive.samples, drive.samples.generation);
        s->v_dc = 0;
        s->point.i = (dq_q15_t){0, i_q};
        sample_box_publish(&drive.samples);
        task_1khz(&drive);
    }
    return command()->safe;
}

/* A link that is really empty draws a current through the diodes, with switching disabled; a sensor that has failed
 * shows none. */
void test_a_dc_sensor_that_fails_closes_no_short_circuit_unless_the_diodes_conduct(void)
{
    run_at(0.4, 0.0);
    seam.motor.gate_fault.i_alive = motor.gate_fault.i_alive;
    TEST_ASSERT_NOT_EQUAL_INT(SAFE_SHORT_CIRCUIT, safe_without_dc_reading(5000, 1));
    drive_raise_fault(&drive, FAULT_UNDER_VOLTAGE);
    TEST_ASSERT_NOT_EQUAL_INT(SAFE_SHORT_CIRCUIT, safe_without_dc_reading(5000, 100)); /* still switching */
    seam.gates = false;
    TEST_ASSERT_NOT_EQUAL_INT(SAFE_SHORT_CIRCUIT, safe_without_dc_reading(0, 1000));
    TEST_ASSERT_NOT_EQUAL_INT(SAFE_SHORT_CIRCUIT, safe_without_dc_reading(5000, 9));
    TEST_ASSERT_EQUAL_INT(SAFE_SHORT_CIRCUIT, safe_without_dc_reading(5000, 1));
}

/* A wrong reference of the converters makes every reading too small; ten steps confirm it. */
void test_the_known_dc_voltage_does_not_fall_while_the_reference_reads_wrong(void)
{
    run_at(0.4, 0.0);
    const q15_t before = drive.task.safe_state.v_dc;
    (void)safe_without_dc_reading(0, 1);
    const q15_t fallen = drive.task.safe_state.v_dc;
    TEST_ASSERT_LESS_THAN_INT(before, fallen);
    seam.known_permille = 1400;
    (void)safe_without_dc_reading(0, 1);
    seam.known_permille = 1000;
    (void)safe_without_dc_reading(0, 1);
    TEST_ASSERT_LESS_THAN_INT(fallen, drive.task.safe_state.v_dc);
    seam.known_permille = 1400;
    (void)safe_without_dc_reading(0, 1);
    const q15_t kept = drive.task.safe_state.v_dc;
    (void)safe_without_dc_reading(0, 5);
    TEST_ASSERT_EQUAL_INT(kept, drive.task.safe_state.v_dc);
}

/* What a fault would bring now, with this i_q at this speed; after 120 steps it is the known one. */
static safe_t safe_with(int32_t i_q, double omega_pu)
{
    sample_at(omega_pu, true, false);
    sample_t *s = sample_box_begin(&drive.samples);
    *s = *sample_box_at(&drive.samples, drive.samples.generation);
    s->point.i = (dq_q15_t){0, i_q};
    s->point.flux = flux_table_step(&motor.flux_table, s->point.i);
    sample_box_publish(&drive.samples);
    for (int k = 0; k < 120; k++) {
        task_1khz(&drive);
    }
    return command()->safe;
}

/* At 0.4 of the speed base 50 N·m feed a quarter of i_max into the dc link; i_q = -20000 makes 80 N·m. */
void test_an_over_voltage_would_short_a_machine_that_charges_the_link_and_no_other(void)
{
    seam_run();
    for (int sign = -1; sign <= 1; sign += 2) {
        TEST_ASSERT_EQUAL_INT(SAFE_SHORT_ON_EITHER, safe_with(-20000 * sign, 0.4 * sign));
        TEST_ASSERT_EQUAL_INT(SAFE_SHORT_ON_GATE_FAULT, safe_with(-2000 * sign, 0.4 * sign));
        TEST_ASSERT_EQUAL_INT(SAFE_SHORT_ON_GATE_FAULT, safe_with(0, 0.4 * sign));
        TEST_ASSERT_EQUAL_INT(SAFE_SHORT_ON_GATE_FAULT, safe_with(20000 * sign, 0.4 * sign));
        TEST_ASSERT_EQUAL_INT(SAFE_FREEWHEEL, safe_with(-20000 * sign, 0.02 * sign));
    }
    seam.motor.safe_state.psi_f = 100; /* a gate fault of a machine with so weak a magnet needs no short circuit */
    TEST_ASSERT_EQUAL_INT(SAFE_SHORT_ON_OVER_VOLTAGE, safe_with(-20000, 0.4));
}

void test_the_torque_comes_back_when_enable_does(void)
{
    run_at(0.9, 0.1);
    drive.request.enable = false;
    for (int n = 0; n < 20; n++) {
        sample_at(0.9, true, false);
        task_1khz(&drive);
    }
    TEST_ASSERT_EQUAL_INT(0, drive.task.torque_commanded);
    drive.request.enable = true;
    for (int n = 0; n < 20; n++) {
        sample_at(0.9, true, false);
        task_1khz(&drive);
    }
    TEST_ASSERT_GREATER_THAN_INT(2000, drive.task.torque_commanded);
}

/* A reset must not wait for the next fault. */
void test_a_reset_while_the_torque_is_held_at_zero_is_refused(void)
{
    run_at(0.9, 0.1);
    drive.request.enable = false;
    task_1khz(&drive);
    drive.request.fault_resets++;
    task_1khz(&drive);
    TEST_ASSERT_EQUAL_UINT32(0, command()->fault_resets);
    drive_raise_fault(&drive, FAULT_OVER_CURRENT);
    task_and_period();
    TEST_ASSERT_EQUAL_INT(RUN_STATE_FAULT, drive.task.run_state);
    TEST_ASSERT_EQUAL_HEX32(FAULT_OVER_CURRENT, drive.fast.faults & FAULT_OVER_CURRENT);
}

/* It is found while the torque is held at zero or while the drive runs: 8 steps to the currents of the short circuit,
 * 2 with them, then it is latched. */
void test_over_temperature_at_speed_is_latched_after_the_currents_have_become_those_of_the_short_circuit(void)
{
    for (int enabled = 0; enabled < 2; enabled++) {
        setUp();
        run_at(0.9, 0.1);
        drive.request.enable = enabled != 0;
        seam.winding_dC = 2400; /* 10 K beyond the trip */
        int last = 0;
        for (int n = 0; n < 200 && command()->run; n++) {
            sample_at(0.9, true, false);
            task_1khz(&drive);
            last = (drive.task.switch_off.steps != 0U) ? drive.task.i_ref.d : last;
        }
        TEST_ASSERT_EQUAL_HEX32(FAULT_TEMPERATURE, command()->faults);
        const flux_point_t at = flux_table_step(&motor.flux_table, (dq_q15_t){last, 0});
        TEST_ASSERT_INT_WITHIN((unsigned)motor.torque_monitor.psi_f / 20U, 0, at.psi_d);
    }
}

/* A fault that may concern the control itself leaves no time for the ramp. */
void test_another_fault_together_with_an_over_temperature_is_latched_at_once(void)
{
    run_at(0.9, 0.1);
    drive.task.gate_fault.switch_shorted = true; /* found in the last step */
    drive.task.plausibility.hot = (uint8_t)(seam.motor.plausibility.hot_steps - 1U);
    seam.winding_dC = 2400;
    sample_at(0.9, true, false);
    task_1khz(&drive);
    TEST_ASSERT_EQUAL_HEX32(FAULT_TEMPERATURE | FAULT_GATE, command()->faults);
    TEST_ASSERT_FALSE(command()->run);
}

/* The references of the current mode are not those of a torque: nothing may hold or move them. */
void test_enable_off_in_the_current_mode_disables_switching_at_any_speed(void)
{
    run_at(0.9, 0.0);
    drive.request.current_mode = true;
    drive.request.enable = false;
    sample_at(0.9, true, false);
    task_1khz(&drive);
    TEST_ASSERT_EQUAL_INT(RUN_STATE_OFF, drive.task.run_state);
    TEST_ASSERT_FALSE(command()->run);
}

/* What the torque path and the resets get from the step. */

void test_each_accepted_reset_counts_once(void)
{
    for (uint32_t n = 1; n <= 3; n++) {
        drive.request.fault_resets++;
        task_1khz(&drive);
        task_1khz(&drive);
        TEST_ASSERT_EQUAL_UINT32(n, drive.task.fault_resets);
    }
}

/* Also what the paper's law has identified is discarded, and the next step does not repeat the reset. */
void test_a_reset_of_the_identification_is_carried_out_once_for_both_laws(void)
{
    drive.request.identification_mode = IDENTIFICATION_PAPER;
    drive.mrai.task.quality.psi_quality = 12345;
    drive.request.identification_resets++;
    seam_run();
    TEST_ASSERT_LESS_THAN_INT32(1000, drive.mrai.task.quality.psi_quality);
    TEST_ASSERT_EQUAL_UINT32(drive.request.identification_resets, drive.task.identification_resets);
    drive.task.recall.unconfirmed = true;
    task_1khz(&drive);
    TEST_ASSERT_TRUE(drive.task.recall.unconfirmed);
}

/* The next start begins as the first one. */
static void expect_reset_torque_path(void)
{
    const task_state_t *task = &drive.task;
    TEST_ASSERT_EQUAL_INT32(0, task->torque_loop.correction);
    TEST_ASSERT_EQUAL_INT32(0, task->torque_limit.loss);
    TEST_ASSERT_EQUAL_HEX16(0, task->derating);
    TEST_ASSERT_EQUAL_INT(motor.torque_max, task->reference.torque_max);
    TEST_ASSERT_EQUAL_INT(Q15_MAX, task->reference.psi_plan);
    TEST_ASSERT_EQUAL_INT32(0, task->voltage_reserve.trim);
    TEST_ASSERT_EQUAL_INT(0, task->allowed.torque_limited);
    TEST_ASSERT_EQUAL_INT(0, task->torque_commanded);
    TEST_ASSERT_EQUAL_INT(0, task->torque_corrected);
}

static void leave_torque_path(void)
{
    drive.task.torque_loop.correction = 300000000;
    drive.task.torque_limit.loss = 100000000;
    drive.task.derating = DERATING_POWER;
    drive.task.voltage_reserve.trim = -100000000;
    drive.task.allowed.torque_limited = 5000;
    drive.task.torque_commanded = 5000;
    drive.task.torque_corrected = 5000;
}

void test_without_switching_nothing_is_left_of_the_torque_path(void)
{
    seam_run();
    leave_torque_path();
    drive.request.enable = false;
    task_1khz(&drive);
    expect_reset_torque_path();
}

/* An over-temperature at speed: the references are those of the ramp to the currents of the short circuit. */
void test_while_the_currents_are_moved_before_a_fault_the_torque_path_is_reset_too(void)
{
    run_at(0.9, 0.1);
    leave_torque_path();
    drive.task.plausibility.hot = (uint8_t)(seam.motor.plausibility.hot_steps - 1U);
    seam.winding_dC = 2400;
    sample_at(0.9, true, false);
    task_1khz(&drive);
    TEST_ASSERT_EQUAL_UINT8(1, drive.task.switch_off.steps);
    TEST_ASSERT_TRUE(command()->run);
    expect_reset_torque_path();
}

/* With the confidence of the paper's law, which is high at once. */
void test_in_current_mode_the_torque_loop_is_off_whatever_the_confidence(void)
{
    drive.request.identification_mode = IDENTIFICATION_PAPER;
    drive.request.torque_arbitrated = 5000;
    drive.request.current_mode = true;
    seam_run();
    for (int n = 0; n < 100; n++) {
        task_1khz(&drive);
    }
    TEST_ASSERT_GREATER_THAN_INT(0, drive.task.identification.confidence);
    TEST_ASSERT_EQUAL_INT32(0, drive.task.torque_loop.correction);
}

void test_after_a_movement_has_ended_the_drive_does_not_run(void)
{
    drive.task.movement.phase = MOVEMENT_PHASE_ENDED;
    seam_run();
    TEST_ASSERT_EQUAL_INT(RUN_STATE_OFF, drive.task.run_state);
    TEST_ASSERT_FALSE(command()->run);
}

/* With a voltage far above its limit the plan is reduced, but not by a voltage that the torque path has not made. */
static q31_t trim_after(bool acting, bool current_mode)
{
    setUp();
    slow_monitors_without_machine(&seam.motor);
    drive.request.current_mode = current_mode;
    seam_run();
    sample_at(0.3, acting, false);
    sample_t *s = &drive.samples.slot[drive.samples.generation % SAMPLE_SLOTS];
    s->point.u = (dq_q15_t){20000, 20000};
    task_1khz(&drive);
    return drive.task.voltage_reserve.trim;
}

void test_the_reserve_of_voltage_follows_only_a_voltage_of_the_torque_path(void)
{
    TEST_ASSERT_LESS_THAN_INT32(0, trim_after(true, false));
    TEST_ASSERT_EQUAL_INT32(0, trim_after(false, false));
    TEST_ASSERT_EQUAL_INT32(0, trim_after(true, true));
    TEST_ASSERT_EQUAL_INT32(0, trim_after(false, true));
}

/* In deep field weakening, below psi_weak, a change of the torque is slower than any calibrated slew. */
void test_where_the_planned_flux_is_small_the_torque_changes_slowly(void)
{
    for (int below = 0; below <= 1; below++) {
        setUp();
        slow_monitors_without_machine(&seam.motor);
        calibrate_slew(Q15_MAX);
        seam_run();
        drive.request.torque_arbitrated = 8000;
        drive.task.reference.psi_plan = (q15_t)(seam.motor.psi_weak - below);
        task_1khz(&drive);
        TEST_ASSERT_EQUAL_INT((below == 1) ? seam.motor.torque_slew_weak : 8000, drive.task.torque_commanded);
    }
}

/* The inverter at the middle of its derating line, and a current that the magnet does not permit. */
void test_the_reasons_of_a_derating_are_those_of_this_step(void)
{
    drive.request.torque_arbitrated = INT16_MAX;
    seam.inverter_dC = (int16_t)(seam.motor.torque_limit.inverter.end - 50);
    seam_run();
    TEST_ASSERT_EQUAL_HEX16(DERATING_INVERTER, drive.task.derating & DERATING_INVERTER);
    TEST_ASSERT_LESS_THAN_INT(motor.torque_max, drive.task.torque_commanded);
    TEST_ASSERT_EQUAL_HEX16(0, drive.task.derating & DERATING_MAGNET);
    drive.task.reference.i_d_limited = true;
    seam.inverter_dC = 250;
    task_1khz(&drive);
    TEST_ASSERT_EQUAL_HEX16(DERATING_MAGNET, drive.task.derating & (DERATING_MAGNET | DERATING_INVERTER));
}

/* Enable off at speed: no power is limited, neither with nor against the rotation. */
void test_a_torque_that_is_held_at_zero_is_not_derated_by_power(void)
{
    for (int sign = -1; sign <= 1; sign += 2) {
        setUp();
        run_at(0.9, 0.1 * sign);
        drive.request.enable = false;
        sample_at(0.9, true, false);
        task_1khz(&drive);
        TEST_ASSERT_EQUAL_INT(RUN_STATE_RUN, drive.task.run_state);
        TEST_ASSERT_EQUAL_HEX16(DERATING_REQUEST, drive.task.derating & (DERATING_REQUEST | DERATING_POWER));
    }
}

/* The current in the period before the sample's: in a short circuit it must stand still, too. */
void test_the_snapshot_has_the_current_of_the_period_before(void)
{
    drive.fast.short_circuit.holds = true;
    for (int n = 0; n < 4; n++) {
        sample_at(0.1, false, false);
    }
    task_1khz(&drive);
    task_1khz(&drive);
    const uint8_t steady = drive.task.safe_state.steady;
    TEST_ASSERT_GREATER_THAN_UINT8(0, steady);
    sample_at(0.1, false, false);
    drive.samples.slot[drive.samples.generation % SAMPLE_SLOTS].point.i = (dq_q15_t){3000, -5000};
    sample_at(0.1, false, false);
    task_1khz(&drive);
    TEST_ASSERT_EQUAL_UINT8(0, drive.task.safe_state.steady);
}

/* The sample half a step before, five periods, has a constant part of phase a. */
void test_the_snapshot_has_the_number_of_its_sample(void)
{
    slow_monitors_without_machine(&seam.motor);
    seam_run();
    for (int n = 0; n < 20; n++) {
        sample_at(0.3, true, false);
    }
    drive.task.i_ref = (dq_q15_t){0, 0};
    drive.samples.slot[(drive.samples.generation - 5U) % SAMPLE_SLOTS].i_ab = fx_pair(3200, 0);
    task_1khz(&drive);
    TEST_ASSERT_EQUAL_INT32(24800, drive.task.short_side.a_q8); /* 256 * 3200/32, of which the next takes a 32nd */
}

/* While nothing is commanded the rotational voltage would be that of the measured flux, in both axes. */
void test_without_switching_the_flux_whose_field_turns_is_the_measured_one(void)
{
    sample_at(0.3, false, false);
    const flux_point_t measured = sample_box_last(&drive.samples)->point.flux;
    drive.task.rotating = (rotating_flux_t){.psi = {1, 2}, .behind = true};
    task_1khz(&drive);
    TEST_ASSERT_NOT_EQUAL_INT(0, measured.psi_q);
    TEST_ASSERT_EQUAL_INT32(measured.psi_d, drive.task.rotating.psi.d);
    TEST_ASSERT_EQUAL_INT32(measured.psi_q, drive.task.rotating.psi.q);
    TEST_ASSERT_FALSE(drive.task.rotating.behind);
}

/* The exchange boxes. */

void test_a_sample_is_not_read_before_it_is_published(void)
{
    sample_at(0.1, true, false);
    sample_t *next = sample_box_begin(&drive.samples);
    next->v_dc = 77;
    TEST_ASSERT_EQUAL_INT(21238, sample_box_last(&drive.samples)->v_dc);
    sample_box_publish(&drive.samples);
    TEST_ASSERT_EQUAL_INT(77, sample_box_last(&drive.samples)->v_dc);
}

void test_the_boxes_survive_the_wrap_of_their_generation(void)
{
    drive.samples.generation = UINT32_MAX - 2U;
    drive.commands.generation = UINT32_MAX - 2U;
    drive.mrai.schedules.generation = UINT32_MAX - 2U;
    for (int n = 0; n < 6; n++) {
        sample_at(0.01 * n, true, false);
        TEST_ASSERT_EQUAL_INT32((q31_t)(0.01 * n * 2147483647.0), sample_box_last(&drive.samples)->point.omega);
        command_box_write(&drive.commands, (command_t){.run = n & 1});
        TEST_ASSERT_EQUAL(n & 1, command_box_read(&drive.commands)->run);
        schedule_box_write(&drive.mrai.schedules, (mrai_schedule_t){.flux_step_q28 = n});
        TEST_ASSERT_EQUAL_INT(n, schedule_box_read(&drive.mrai.schedules)->flux_step_q28);
    }
}
