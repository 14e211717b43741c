/* SPDX-License-Identifier: Apache-2.0 */
/* The 1 kHz task's part of the paper's identification: what it reports, what a reset discards, and when it stalls. */
#include "drive/mrai/mrai_seam.h"
#include "hal/mock_adc.h"
#include "hal/mock_angle.h"
#include "hal/mock_irq.h"
#include "hal/mock_pwm.h"
#include "hal/mock_temperature.h"
#include "seam.h"
#include "unity.h"

static snapshot_t snapshot;
static const identification_t *const reported = &drive.task.identification;
static mrai_quality_t *const quality = &drive.mrai.task.quality;

void setUp(void)
{
    seam_start();
    snapshot = (snapshot_t){0};
}

void tearDown(void)
{
}

void test_parameters_flux_error_and_quality_of_the_law_are_reported(void)
{
    *quality = (mrai_quality_t){.psi_quality = 20000, .r_quality = 10000};
    snapshot.mrai.law = (mrai_state_t){.psi_delta = -1000000, .r_delta = 300000};
    snapshot.psi_d_error = -15;
    mrai_identify(&drive, &snapshot);
    TEST_ASSERT_EQUAL_INT32(-1000000, reported->psi_delta);
    TEST_ASSERT_EQUAL_INT32(300000, reported->r_delta);
    TEST_ASSERT_EQUAL_INT(-15, reported->psi_d_error);
    TEST_ASSERT_EQUAL_INT(20000, reported->psi_quality);
    TEST_ASSERT_EQUAL_INT(10000, reported->r_quality);
}

void test_each_parameter_at_its_limit_is_reported_as_such(void)
{
    mrai_identify(&drive, &snapshot);
    TEST_ASSERT_FALSE(reported->psi_clamped);
    TEST_ASSERT_FALSE(reported->r_clamped);
    snapshot.mrai.law = (mrai_state_t){.psi_delta = motor.mrai->psi_delta_min};
    mrai_identify(&drive, &snapshot);
    TEST_ASSERT_TRUE(reported->psi_clamped);
    TEST_ASSERT_FALSE(reported->r_clamped);
    snapshot.mrai.law = (mrai_state_t){.r_delta = motor.mrai->r_delta_max};
    mrai_identify(&drive, &snapshot);
    TEST_ASSERT_FALSE(reported->psi_clamped);
    TEST_ASSERT_TRUE(reported->r_clamped);
}

/* Without adaptation both fall by the share quality_rate in a step (MR-18); one LSB for its rounding. */
void test_the_quality_of_the_step_is_reported_in_the_same_step(void)
{
    const double left = 1.0 - motor.mrai->quality_rate / 32768.0;
    *quality = (mrai_quality_t){.psi_quality = 20000, .r_quality = 10000};
    mrai_identify(&drive, &snapshot);
    mrai_reschedule(&drive, &snapshot, &snapshot.sample.point);
    TEST_ASSERT_INT_WITHIN(1, (int)(20000.0 * left), reported->psi_quality);
    TEST_ASSERT_INT_WITHIN(1, (int)(10000.0 * left), reported->r_quality);
}

void test_a_reset_leaves_nothing_of_the_quality(void)
{
    const mrai_quality_t none = {0};
    *quality = (mrai_quality_t){.psi_quality = 20000, .r_quality = 10000, .psi_last = -1000000, .r_last = 300000};
    mrai_discard(&drive);
    TEST_ASSERT_EQUAL_MEMORY(&none, quality, sizeof none);
}

/* Between two steps of the task the interrupt finishes ten points. */
void test_the_interrupt_stalls_if_a_point_waits_and_none_has_been_finished_since_the_last_step(void)
{
    TEST_ASSERT_FALSE(mrai_is_stalled(&drive));
    TEST_ASSERT_FALSE_MESSAGE(mrai_is_stalled(&drive), "no point waits");
    drive.mrai.mailbox.generation = 11;
    drive.mrai.isr.finished = 10;
    TEST_ASSERT_FALSE_MESSAGE(mrai_is_stalled(&drive), "points have been finished since the last step");
    TEST_ASSERT_TRUE(mrai_is_stalled(&drive));
    TEST_ASSERT_TRUE(mrai_is_stalled(&drive));
    drive.mrai.isr.finished = 11;
    TEST_ASSERT_FALSE(mrai_is_stalled(&drive));
    TEST_ASSERT_FALSE(mrai_is_stalled(&drive));
}
