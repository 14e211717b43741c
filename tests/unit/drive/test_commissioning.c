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

/* A winding of r times the motor's resistance behind an inverter with a constant voltage error, per unit; the angle is
 * zero, so that the cosines of the phases are 1, 1/2 and 1/2 and the error of the d voltage is 4/3 of a phase's. Before
 * the last step of the measurement; its voltage is rounded to q15, which is 0.2 % of it. */
static void measured(double r, double error)
{
    const commission_config_t *config = &motor.commission;
    const double r_pu = r * motor.identify.r0 / (2.0 * ONE_Q30);
    *commission = (commission_state_t){.phase = COMMISSION_MEASURE,
                                       .steps = (uint16_t)(config->measure_steps - 1U),
                                       .index = 2U * COMMISSION_LEVELS - 1U};
    for (unsigned k = 0; k < COMMISSION_LEVELS; k++) {
        const double i = config->i_max / 32768.0 * pow(2.0, -6.0 + 0.5 * k);
        const double u = r_pu * i + error * 4.0 / 3.0;
        const double share = (k == COMMISSION_LEVELS - 1U) ? 0.5 : 1.0; /* the other polarity of the last one follows */
        commission->data.i[k] = (int32_t)lround(share * i * ONE_Q30);
        commission->data.u[k] = (int32_t)lround(share * u * ONE_Q30);
        commission->i_ref.d = -(int32_t)lround(i * 32768.0);
        snapshot.window.sum_i.d = config->periods_per_step * commission->i_ref.d;
        snapshot.window.sum_u.d = config->periods_per_step * -(int32_t)lround(u * 32768.0);
    }
    commission->sum_i = (config->measure_steps - 1) * snapshot.window.sum_i.d;
    commission->sum_u = (config->measure_steps - 1) * snapshot.window.sum_u.d;
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

void test_without_an_end_of_the_measurement_nothing_changes(void)
{
    const int before = dead_time();
    drive_commission(&drive, &snapshot);
    TEST_ASSERT_EQUAL_INT(COMMISSION_IDLE, commission->phase);
    commission->phase = COMMISSION_DONE; /* of the commissioning before */
    drive_commission(&drive, &snapshot);
    measured(1.0, 0.004);
    commission->steps = 0;
    drive_commission(&drive, &snapshot);
    TEST_ASSERT_EQUAL_INT(COMMISSION_MEASURE, commission->phase);
    TEST_ASSERT_EQUAL_INT(before, dead_time());
}

void test_levels_that_do_not_rise_do_not_fit(void)
{
    measured(1.0, 0.004);
    commission->data.i[4] = commission->data.i[3];
    does_not_fit();
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
