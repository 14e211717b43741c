/* SPDX-License-Identifier: Apache-2.0 */
#include "drive/mrai/mrai_seam.h"
#include "drive/mrai/schedule_box.h"
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
    drive.request.identification_mode = IDENTIFICATION_PAPER;
}

void tearDown(void)
{
}

/* A sample as the fast ISR offers it: 71 A, 0.3 omega_b, and the voltage of a machine with a weak magnet. */
static void publish(bool acting)
{
    sample_t *s = sample_box_begin(&drive.samples);
    const dq_q15_t i = {-3000, 5000};
    const operating_point_t in = {.i = i, .flux = flux_table_step(&motor.flux_table, i), .omega = 0x26666666};
    *s = (sample_t){.point = in, .acting = acting};
    s->point.u.d = (q15_t)(-0.3 * s->point.flux.psi_q - 0.0133 * 3000);
    s->point.u.q = (q15_t)(0.3 * (s->point.flux.psi_d - 1500) + 0.0133 * 5000);
    seam.log[0] = '\0';
    mrai_offer(&drive, sample_box_publish(&drive.samples));
}

/* As the 1 kHz task does: with weights of the voltage that are those of the period. 1/sinc is below 1.0005 here. */
static void enable(int32_t flux_step_q28)
{
    const int32_t voltage_q28 = -(drive.mrai_parameters.period / 8);
    drive.request.identification = true;
    schedule_box_write(&drive.mrai.schedules, (mrai_schedule_t){.flux_step_q28 = flux_step_q28,
                                                                .minus_voltage_d_q28 = 2 * voltage_q28,
                                                                .minus_voltage_q28 = voltage_q28});
}

static void enable_adaptation(void)
{
    enable(60000000);
}

/* The error that the weak magnet of publish() makes in one period, omega_b T_s w dpsi = 0.33 * 0.3 * 0.046 = 0.0045 pu.
 * The voltages are truncated to whole LSB: 0.33 * 2^-15 = 1e-5 pu, twice of it in the d axis. */
static void expect_the_error_of_one_period(void)
{
    const double period = drive.mrai_parameters.period / 2147483648.0;
    const double e_q = period * 0.3 * 1500.0 / 32768.0;
    TEST_ASSERT_DOUBLE_WITHIN(3e-5, 0.0, drive.mrai.isr.law.e_d_q27 / 134217728.0);
    TEST_ASSERT_DOUBLE_WITHIN(3e-5, e_q, drive.mrai.isr.law.e_q_q27 / 134217728.0);
}

void test_the_interrupt_reports_that_it_has_finished(void)
{
    publish(false);
    TEST_ASSERT_NOT_EQUAL(drive.mrai.mailbox.generation, drive.mrai.isr.finished);
    mrai_isr(&drive);
    TEST_ASSERT_EQUAL_INT(drive.mrai.mailbox.generation, drive.mrai.isr.finished);
}

void test_while_the_bridge_does_not_act_nothing_is_identified(void)
{
    enable_adaptation();
    for (int n = 0; n < 100; n++) {
        publish(false);
        mrai_isr(&drive);
    }
    TEST_ASSERT_EQUAL_INT32(0, drive.mrai.isr.law.psi_delta);
    TEST_ASSERT_EQUAL_INT32(0, drive.mrai.isr.law.e_q_q27);
}

void test_while_the_bridge_acts_the_flux_is_identified_and_passed_to_the_fast_isr_rounded(void)
{
    enable_adaptation();
    publish(false);
    mrai_isr(&drive);
    for (int n = 0; n < 500; n++) {
        publish(true);
        mrai_isr(&drive);
    }
    TEST_ASSERT_LESS_THAN_INT32(-1000000, drive.mrai.isr.law.psi_delta);
    TEST_ASSERT_EQUAL_INT((drive.mrai.isr.law.psi_delta + 32768) >> 16, drive.psi_d_error);
}

/* The observer starts from the last sample before switching was enabled, so that enabling is no step for it. */
void test_the_first_acting_sample_continues_the_last_one_before_it(void)
{
    enable(0);
    publish(false);
    mrai_isr(&drive);
    publish(true);
    mrai_isr(&drive);
    expect_the_error_of_one_period();
}

void test_the_torque_estimate_runs_with_the_bridge_on_or_off(void)
{
    for (int n = 0; n < 10; n++) {
        publish(n % 2 == 0);
        mrai_isr(&drive);
    }
    const flux_point_t f = flux_table_step(&motor.flux_table, (dq_q15_t){-3000, 5000});
    TEST_ASSERT_INT_WITHIN(2, (f.psi_d * 5000 + f.psi_q * 3000) / 32768,
                           torque_estimate_mean(&drive.mrai.task.torque_mean, &drive.mrai.isr.torque));
}

void test_a_reset_discards_what_was_identified_without_a_step(void)
{
    enable_adaptation();
    publish(false);
    mrai_isr(&drive);
    for (int n = 0; n < 500; n++) {
        publish(true);
        mrai_isr(&drive);
    }
    drive.request.identification_resets++;
    publish(true);
    mrai_isr(&drive);
    TEST_ASSERT_EQUAL_INT32(0, drive.mrai.isr.law.psi_delta);
    TEST_ASSERT_EQUAL_INT(0, drive.psi_d_error);
    publish(true);
    mrai_isr(&drive);
    expect_the_error_of_one_period();
}

/* After a gap the errors of the observer are zero again: its sums from before do not fit the period after it. */
static void expect_restart(void)
{
    publish(true);
    mrai_isr(&drive);
    TEST_ASSERT_EQUAL_INT32(0, drive.mrai.isr.law.e_d_q27);
    TEST_ASSERT_EQUAL_INT32(0, drive.mrai.isr.law.e_q_q27);
}

static void run_for(int periods)
{
    for (int n = 0; n < periods; n++) {
        publish(true);
        mrai_isr(&drive);
    }
    TEST_ASSERT_NOT_EQUAL(0, drive.mrai.isr.law.e_q_q27);
}

void test_the_law_restarts_after_periods_in_which_the_other_identification_was_chosen(void)
{
    run_for(20);
    for (int n = 0; n < 5; n++) {
        (void)sample_box_begin(&drive.samples);
        sample_box_publish(&drive.samples);
    }
    expect_restart();
}

void test_a_point_that_comes_too_early_is_dropped_and_the_law_restarts_after_it(void)
{
    run_for(20);
    publish(true);
    const uint32_t in_work = drive.samples.generation;
    publish(false);
    TEST_ASSERT_EQUAL_UINT32(1, mrai_overruns(&drive));
    TEST_ASSERT_EQUAL_UINT32(in_work, drive.mrai.mailbox.generation);
    mrai_isr(&drive);
    TEST_ASSERT_EQUAL_UINT32(in_work, drive.mrai.isr.finished);
    expect_restart();
}

/* The newest sample says that the bridge is off, the one in work that it acts. */
void test_the_interrupt_uses_the_sample_for_which_it_was_pended(void)
{
    run_for(20);
    const mrai_isr_state_t before = drive.mrai.isr;
    publish(true);
    mrai_isr(&drive);
    const mrai_isr_state_t undisturbed = drive.mrai.isr;
    drive.mrai.isr = before;
    sample_t *later = sample_box_begin(&drive.samples);
    *later = (sample_t){.acting = false};
    sample_box_publish(&drive.samples);
    mrai_isr(&drive);
    TEST_ASSERT_EQUAL_MEMORY(&undisturbed, &drive.mrai.isr, sizeof undisturbed);
}
