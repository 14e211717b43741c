/* SPDX-License-Identifier: Apache-2.0 */
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

/* A sample as the fast ISR publishes it: 60 A, 0.3 omega_b, the voltage that belongs to it. */
static void publish(bool acting)
{
    sample_t *s = sample_box_begin(&drive.samples, drive.samples.generation + 1U);
    const dq_t i = {-3000, 5000};
    const mrai_in_t in = {.i = i, .flux = flux_table_step(&motor.flux_table, i), .omega = 0x26666666};
    *s = (sample_t){.mrai = in, .acting = acting};
    s->mrai.u.d = (q15_t)(-0.3 * s->mrai.flux.psi_q - 0.0133 * 3000);
    s->mrai.u.q = (q15_t)(0.3 * (s->mrai.flux.psi_d - 1500) + 0.0133 * 5000); /* a weak magnet */
    sample_box_publish(&drive.samples, drive.samples.generation + 1U);
}

static void open_gates(void)
{
    drive.request.identification = true;
    schedule_box_write(&drive.schedules, (mrai_schedule_t){.flux_step_q28 = 60000000});
}

void test_it_tells_that_it_has_finished(void)
{
    publish(false);
    TEST_ASSERT_NOT_EQUAL(drive.samples.generation, drive.slow.finished);
    mrai_isr(&drive);
    TEST_ASSERT_EQUAL_INT(drive.samples.generation, drive.slow.finished);
}

void test_with_the_bridge_off_nothing_is_learnt(void)
{
    open_gates();
    for (int n = 0; n < 100; n++) {
        publish(false);
        mrai_isr(&drive);
    }
    TEST_ASSERT_EQUAL_INT32(0, drive.slow.mrai.psi_delta);
    TEST_ASSERT_EQUAL_INT32(0, drive.slow.mrai.e_q_q27);
}

void test_with_the_bridge_on_the_flux_is_learnt_and_handed_to_the_fast_isr_rounded(void)
{
    open_gates();
    publish(false);
    mrai_isr(&drive);
    for (int n = 0; n < 500; n++) {
        publish(true);
        mrai_isr(&drive);
    }
    TEST_ASSERT_LESS_THAN_INT32(-1000000, drive.slow.mrai.psi_delta);
    TEST_ASSERT_EQUAL_INT((drive.slow.mrai.psi_delta + 32768) >> 16, drive.slow.psi_delta_q15);
}

/* The observer starts from the last sample with the bridge off: switching on is no event to it. */
void test_the_first_acting_sample_continues_the_last_resting_one(void)
{
    publish(false);
    mrai_isr(&drive);
    publish(true);
    mrai_isr(&drive);
    TEST_ASSERT_INT_WITHIN(1 << 24, 0, drive.slow.mrai.e_d_q27); /* 1/64 pu: one period of a weak magnet */
    TEST_ASSERT_INT_WITHIN(1 << 24, 0, drive.slow.mrai.e_q_q27);
}

void test_the_torque_estimate_runs_with_the_bridge_on_or_off(void)
{
    for (int n = 0; n < 10; n++) {
        publish(n % 2 == 0);
        mrai_isr(&drive);
    }
    const flux_point_t f = flux_table_step(&motor.flux_table, (dq_t){-3000, 5000});
    TEST_ASSERT_INT_WITHIN(2, (f.psi_d * 5000 + f.psi_q * 3000) / 32768,
                           torque_estimate_mean(&drive.task.torque_mean, &drive.slow.torque));
}

void test_a_reset_forgets_what_was_learnt_without_a_kick(void)
{
    open_gates();
    publish(false);
    mrai_isr(&drive);
    for (int n = 0; n < 500; n++) {
        publish(true);
        mrai_isr(&drive);
    }
    drive.request.identification_resets++;
    publish(true);
    mrai_isr(&drive);
    TEST_ASSERT_EQUAL_INT32(0, drive.slow.mrai.psi_delta);
    TEST_ASSERT_EQUAL_INT(0, drive.slow.psi_delta_q15);
    publish(true);
    mrai_isr(&drive);
    TEST_ASSERT_INT_WITHIN(1 << 24, 0, drive.slow.mrai.e_d_q27);
    TEST_ASSERT_INT_WITHIN(1 << 24, 0, drive.slow.mrai.e_q_q27);
}
