/* SPDX-License-Identifier: Apache-2.0 */
#include <math.h>

#include "drive/publish.h"
#include "drive/recall.h"
#include "hal/mock_adc.h"
#include "hal/mock_angle.h"
#include "hal/mock_irq.h"
#include "hal/mock_pwm.h"
#include "hal/mock_temperature.h"
#include "hal/temperature.h"
#include "seam.h"
#include "unity.h"

/* The path of the robust identification between the priorities: window, step, result, stored record. */

static double omega; /* per unit of omega_b */
static int32_t unit; /* the current is (-3, 5) times this, in counts */
static int weak;     /* missing magnet flux in counts */
static uint32_t now; /* in periods */
static double lost;  /* voltage in counts along the current that the nominal compensation does not compensate */

/* In q15. */
static int32_t dead_time(const motor_parameters_t *p)
{
    return p->modulate.dead_time_q16 / 2;
}

void setUp(void)
{
    omega = 0.3;
    unit = 1000;
    weak = 1434;
    now = 0;
    lost = 0.0;
    seam_start();
    seam.winding_dC = 200;
}

void tearDown(void)
{
}

/* A sample as the fast ISR publishes it: 71 A and a magnet that is 10 % weak, unless a test changes them. */
static void period(uint32_t k)
{
    sample_t *s = sample_box_begin(&drive.samples);
    const dq_q15_t i = {-3 * unit, 5 * unit};
    const q31_t speed = (q31_t)(omega * 2147483648.0);
    const operating_point_t in = {.i = i, .flux = flux_table_step(&motor.flux_table, i), .omega = speed};
    *s = (sample_t){.point = in, .acting = true, .v_dc = 21238};
    s->point.u.d = (int32_t)(-omega * s->point.flux.psi_q + 0.0133 * i.d);
    s->point.u.q = (int32_t)(omega * (s->point.flux.psi_d - weak) + 0.0133 * i.q);
    /* A voltage that the compensation adds need not be commanded any more. */
    const double left = lost - 4.0 / 3.14159265 * 21238.0 *
                                   (dead_time(&drive.parameters) - dead_time(&motor.parameters)) / 32768.0;
    s->point.u.d += (int32_t)lround(left * -3.0 / 5.831);
    s->point.u.q += (int32_t)lround(left * 5.0 / 5.831);
    s->theta_e = (uint32_t)(k * omega * 3298.672 * 1e-4 / 6.283185307 * 4294967296.0);
    seam.log[0] = '\0';
    publish_sample(&drive, s);
    if (drive.request.identification_mode == IDENTIFICATION_PAPER) {
        mrai_isr(&drive);
    }
}

static void milliseconds(int n)
{
    for (int k = 0; k < 10 * n; k++) {
        period(now++);
        if (k % 10 == 9) {
            task_1khz(&drive);
        }
    }
}

void test_robust_is_the_default_and_ten_periods_make_a_window(void)
{
    TEST_ASSERT_EQUAL_INT(IDENTIFICATION_ROBUST, drive.request.identification_mode);
    for (uint32_t k = 0; k < 20; k++) {
        TEST_ASSERT_EQUAL_UINT32(k / 10U, drive.windows.generation);
        period(k);
    }
    const identify_window_t window = *window_box_at(&drive.windows);
    TEST_ASSERT_EQUAL_INT(-30000, window.sum_i.d);
    TEST_ASSERT_EQUAL_INT(50000, window.sum_i.q);
    TEST_ASSERT_TRUE(window.acting);
}

void test_a_weak_magnet_is_identified_and_its_flux_passed_to_the_current_control(void)
{
    milliseconds(3000);
    /* 10 % of psi_f are 1434 counts. A single point cannot separate magnet and inductances, which share the error. */
    TEST_ASSERT_LESS_THAN_INT(-700, drive.task.psi_d_error);
    fast_isr(&drive);
    TEST_ASSERT_EQUAL_INT(drive.task.psi_d_error, drive.psi_d_error);
    TEST_ASSERT_LESS_THAN_INT32(0, drive.task.identification.psi_delta);
    TEST_ASSERT_GREATER_THAN_INT(20000, drive.task.identification.psi_quality);
    TEST_ASSERT_FALSE(drive.task.identification.psi_clamped);
}

void test_a_reset_discards_what_was_identified(void)
{
    milliseconds(500);
    TEST_ASSERT_NOT_EQUAL(0, drive.task.identification.psi_delta);
    drive.request.identification_resets++;
    task_1khz(&drive);
    TEST_ASSERT_EQUAL_INT32(0, drive.task.identification.psi_delta);
    TEST_ASSERT_EQUAL_INT(0, drive.task.identification.psi_quality);
}

void test_the_winding_temperature_reaches_the_resistance_and_a_broken_sensor_does_not(void)
{
    seam.winding_dC = 1200;
    milliseconds(1);
    /* 0.018 ohm, 0.393 % per kelvin, 100 K: 39.3 % more, 0.00707 ohm of 1.35. */
    TEST_ASSERT_INT32_WITHIN(3000, (int32_t)(0.007074 / 1.35 * 2147483648.0), drive.task.identification.r_delta);
    seam.winding_dC = TEMPERATURE_UNKNOWN;
    milliseconds(1);
    TEST_ASSERT_FALSE(drive.task.identify.kept.r_known);
    TEST_ASSERT_INT32_WITHIN(3000, (int32_t)(0.007074 / 1.35 * 2147483648.0), drive.task.identification.r_delta);
}

void test_what_was_identified_can_be_kept_and_recalled(void)
{
    milliseconds(1000);
    const identify_record_t kept = drive_identified_record(&drive);
    const q31_t before = drive.task.identification.psi_delta;
    drive_init(&drive, &motor);
    TEST_ASSERT_TRUE(drive_recall(&drive, &kept));
    TEST_ASSERT_TRUE(drive.task.recall.unconfirmed);
    task_1khz(&drive);
    TEST_ASSERT_INT32_WITHIN(2000, before, drive.task.identification.psi_delta);
    identify_record_t foreign = kept;
    foreign.version = 0;
    drive_init(&drive, &motor);
    TEST_ASSERT_FALSE(drive_recall(&drive, &foreign));
    TEST_ASSERT_FALSE(drive.task.recall.unconfirmed);
}

/* The windows of a machine that is that of the tables: three updates of ten steps agree. */
void test_recalled_values_are_confirmed_by_windows_that_agree(void)
{
    weak = 0;
    recall_begin(&drive);
    milliseconds(20);
    TEST_ASSERT_TRUE(drive.task.recall.unconfirmed);
    milliseconds(40);
    TEST_ASSERT_FALSE(drive.task.recall.unconfirmed);
}

void test_while_recalled_values_are_not_confirmed_nothing_that_acts_on_the_torque_is_reported(void)
{
    const identification_t *const reported = &drive.task.identification;
    milliseconds(3000);
    TEST_ASSERT_GREATER_THAN_INT(0, reported->confidence);
    TEST_ASSERT_LESS_THAN_INT(-700, reported->psi_d_error);
    drive.task.identify.kalman.x_q27[IDENTIFY_LQ] = IDENTIFY_ONE_Q27 / 2;
    milliseconds(1);
    TEST_ASSERT_NOT_EQUAL(0, reported->lq_error);
    recall_begin(&drive);
    milliseconds(1);
    TEST_ASSERT_EQUAL_INT(0, reported->confidence);
    TEST_ASSERT_EQUAL_INT(0, reported->psi_d_error);
    TEST_ASSERT_EQUAL_INT32(0, reported->lq_error);
    TEST_ASSERT_LESS_THAN_INT32(0, reported->psi_delta); /* does not act */
}

static void assert_limits(bool flux, bool resistance)
{
    const snapshot_t off = {.winding_dC = TEMPERATURE_UNKNOWN};
    drive.task.identify.steps = 5; /* neither the update nor its prediction follows */
    drive_identify(&drive, &off);
    TEST_ASSERT_EQUAL(flux, drive.task.identification.psi_clamped);
    TEST_ASSERT_EQUAL(resistance, drive.task.identification.r_clamped);
}

/* In Q27 four are 2^29. */
void test_a_flux_or_a_resistance_of_four_standard_deviations_is_reported_as_at_its_limit(void)
{
    identify_state_t *const state = &drive.task.identify;
    for (int sign = -1; sign <= 1; sign += 2) {
        setUp();
        identify_set(state, IDENTIFY_FLUX, sign * ((1 << 29) - 1));
        identify_set(state, IDENTIFY_R, sign * ((1 << 29) - 1));
        assert_limits(false, false);
        identify_set(state, IDENTIFY_FLUX, sign * (1 << 29));
        assert_limits(true, false);
        identify_set(state, IDENTIFY_FLUX, 0);
        identify_set(state, IDENTIFY_R, sign * (1 << 29));
        assert_limits(false, true);
    }
}

/* Half and a quarter of the prior's variance are left: the quality is what has gone. */
void test_the_quality_is_the_share_of_the_variance_that_has_gone(void)
{
    int32_t *const p_q30 = drive.task.identify.kalman.p_q30;
    p_q30[kalman_p_index(IDENTIFY_FLUX, IDENTIFY_FLUX)] = 1 << 29;
    p_q30[kalman_p_index(IDENTIFY_R, IDENTIFY_R)] = 1 << 28;
    assert_limits(false, false);
    TEST_ASSERT_INT_WITHIN(1, 16384, drive.task.identification.psi_quality);
    TEST_ASSERT_INT_WITHIN(1, 24576, drive.task.identification.r_quality);
}

void test_the_variance_of_the_torque_is_reported(void)
{
    milliseconds(100);
    TEST_ASSERT_GREATER_THAN_INT32(0, drive.task.identify.torque_variance_q30);
    TEST_ASSERT_EQUAL_INT32(drive.task.identify.torque_variance_q30, drive.task.identification.torque_variance_q30);
}

/* The window is one in which the bridge acted; since then switching has been disabled. */
void test_a_sample_without_the_bridge_identifies_nothing(void)
{
    milliseconds(2);
    snapshot_t snapshot = {.sample = *sample_box_at(&drive.samples, drive.samples.generation),
                           .window = *window_box_at(&drive.windows),
                           .winding_dC = 200};
    TEST_ASSERT_TRUE(snapshot.window.acting);
    for (int acting = 0; acting <= 1; acting++) {
        snapshot.sample.acting = acting != 0;
        for (unsigned n = 0; n < 3U * IDENTIFY_STEPS; n++) {
            drive_identify(&drive, &snapshot);
        }
        TEST_ASSERT_EQUAL(acting != 0, drive.task.identify.kalman.x_q27[IDENTIFY_FLUX] != 0);
    }
}

/* By the number of steps a lower priority notices that a step has changed the values while it copied them. */
void test_each_step_of_the_identification_is_counted(void)
{
    const uint32_t before = drive.task.identifications;
    milliseconds(7);
    TEST_ASSERT_EQUAL_UINT32(before + 7U, drive.task.identifications);
}

void test_the_papers_identification_starts_from_its_sample_when_it_is_selected(void)
{
    milliseconds(2);
    drive.request.identification_mode = IDENTIFICATION_PAPER;
    period(0);
    TEST_ASSERT_EQUAL_INT32(0, drive.mrai.isr.law.e_d_q27);
    TEST_ASSERT_EQUAL_INT32(0, drive.mrai.isr.law.e_q_q27);
    task_1khz(&drive);
    TEST_ASSERT_NOT_EQUAL(0, drive.mrai.isr.torque.count);
    TEST_ASSERT_EQUAL_INT(drive.mrai.task.torque_mean.mean, drive.task.identification.torque_estimated);
}

/* The robust identification may have found a scale of psi_q: under the other law the torque path must not keep it. */
void test_the_papers_identification_reports_what_it_does_not_identify_as_the_tables(void)
{
    drive.task.identify.kalman.x_q27[IDENTIFY_LQ] = IDENTIFY_ONE_Q27 / 2;
    milliseconds(1);
    TEST_ASSERT_GREATER_THAN_INT32(0, drive.task.identification.lq_error);
    drive.request.identification_mode = IDENTIFICATION_PAPER;
    milliseconds(1);
    TEST_ASSERT_EQUAL_INT32(0, drive.task.identification.lq_error);
    TEST_ASSERT_EQUAL_INT32(Q31_MAX, drive.task.identification.torque_variance_q30);
    TEST_ASSERT_EQUAL_INT(Q15_MAX, drive.task.identification.confidence);
}

void test_the_window_box_survives_the_wrap_of_its_generation(void)
{
    drive.windows.generation = UINT32_MAX;
    for (int n = 0; n < 4; n++) {
        const identify_window_t window = {.limited = (uint8_t)n};
        window_box_write(&drive.windows, &window);
        TEST_ASSERT_EQUAL_INT(n, window_box_at(&drive.windows)->limited);
    }
}

/* At low speed the voltage error of the inverter can be separated from the magnet flux. */
static void at_low_speed(void)
{
    omega = 0.04;
    weak = 0;
    lost = 100.0;
}

/* Two magnitudes of the current, by which the voltage error differs from that of a resistance. */
static void change_current(int n)
{
    unit = (n % 2 == 0) ? 1500 : 300;
}

/* 100 counts are 1.65 V: pi/4 of that, divided by the dc voltage of 21238 counts, are 121 LSB of duty. */
void test_the_identified_voltage_error_is_added_to_the_compensation(void)
{
    at_low_speed();
    for (int n = 0; n < 30; n++) {
        change_current(n);
        milliseconds(4000);
    }
    const int last = drive.task.identification.torque_estimated;
    milliseconds(1000);
    TEST_ASSERT_INT_WITHIN((unsigned)motor.torque_max / 1000U, last, drive.task.identification.torque_estimated);
    TEST_ASSERT_INT_WITHIN(30, dead_time(&motor.parameters) + 121, dead_time(&drive.parameters));
    TEST_ASSERT_EQUAL_INT32(dead_time(&drive.parameters) - dead_time(&motor.parameters), drive.task.trim.trim);
    TEST_ASSERT_LESS_OR_EQUAL_UINT32(motor.parameters.current_control.clear_q30,
                                     drive.parameters.current_control.clear_q30);
    drive.request.identification_resets++;
    task_1khz(&drive);
    TEST_ASSERT_EQUAL_INT(dead_time(&motor.parameters), dead_time(&drive.parameters));
}

/* Long enough for the trim to change the compensation. A mismatch_share that is not 0 is set again in each step. */
static void identify_voltage_error(bool trim, q15_t mismatch_share)
{
    at_low_speed();
    drive.request.trim = trim;
    for (int n = 0; n < 20000; n++) {
        change_current(n / 4000);
        if (mismatch_share != 0) {
            drive.task.identify.kept.mismatch_share = mismatch_share;
        }
        milliseconds(1);
    }
}

void test_the_compensation_changes_only_with_trim(void)
{
    identify_voltage_error(false, 0);
    TEST_ASSERT_EQUAL_INT(dead_time(&motor.parameters), dead_time(&drive.parameters));
    TEST_ASSERT_GREATER_THAN_INT32(0, drive.task.identify.kalman.x_q27[IDENTIFY_DROP]);
    identify_voltage_error(true, 0);
    TEST_ASSERT_GREATER_THAN_INT(dead_time(&motor.parameters), dead_time(&drive.parameters));
}

/* What is identified does not explain the voltages: it may be another error than the inverter's. The bound is a
 * quarter; until the trim reads the share, an update of the identification may have reduced it by a twentieth. */
void test_the_compensation_changes_only_while_the_residuals_agree_with_the_model(void)
{
    identify_voltage_error(true, Q15(0.28));
    TEST_ASSERT_EQUAL_INT(dead_time(&motor.parameters), dead_time(&drive.parameters));
    identify_voltage_error(true, Q15(0.24));
    TEST_ASSERT_GREATER_THAN_INT(dead_time(&motor.parameters), dead_time(&drive.parameters));
}
