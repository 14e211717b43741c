/* SPDX-License-Identifier: Apache-2.0 */
/* A port whose drivers are still those of hal/template never enables switching, whatever is requested. */
#include "drive/drive.h"
#include "hal/pwm.h"
#include "unity.h"

#define PERIODS 2000U
#define TASK_PERIODS 10U

static drive_t drive;
static uint32_t writes, periods_enabled;
static bool enabled;

void hal_pwm_write(duty_t duty)
{
    (void)duty;
    writes++;
}

void hal_pwm_enable(bool on)
{
    enabled = on;
}

bool hal_pwm_gates(void)
{
    return enabled;
}

void setUp(void)
{
    writes = 0;
    periods_enabled = 0;
    enabled = false;
    drive_init(&drive, &motor);
}

void tearDown(void)
{
}

static void run(uint32_t periods)
{
    for (uint32_t k = 1; k <= periods; k++) {
        fast_isr(&drive);
        periods_enabled += enabled ? 1U : 0U;
        if (k % TASK_PERIODS == 0U) {
            task_1khz(&drive);
        }
    }
}

void test_the_first_sample_latches_over_current(void)
{
    run(1);
    TEST_ASSERT_TRUE(drive.fast.faults & FAULT_OVER_CURRENT);
}

void test_a_request_does_not_enable_switching(void)
{
    drive.request.enable = true;
    drive.request.torque_arbitrated = 1000;
    run(PERIODS);
    TEST_ASSERT_EQUAL_UINT32(PERIODS, writes);
    TEST_ASSERT_EQUAL_UINT32(0, periods_enabled);
}

void test_a_reset_of_the_faults_and_a_request_do_not_enable_switching(void)
{
    run(PERIODS);
    drive.request.fault_resets++;
    run(PERIODS);
    drive.request.enable = true;
    run(PERIODS);
    TEST_ASSERT_TRUE(drive.fast.faults & FAULT_OVER_CURRENT);
    TEST_ASSERT_EQUAL_UINT32(0, periods_enabled);
}
