/* SPDX-License-Identifier: Apache-2.0 */
/* What the monitor of the current sensors' gain gets from the ring of the samples. The decision is tested in
 * tests/unit/safety/test_current_jump.c. */
#include "drive/current_gain.h"

#include "hal/mock_adc.h"
#include "hal/mock_angle.h"
#include "hal/mock_irq.h"
#include "hal/mock_pwm.h"
#include "hal/mock_temperature.h"
#include "seam.h"
#include "unity.h"

#define PERIODS 10U /* of a step on hsm1 */
#define AFTER 8U    /* periods in which the current must be quiet after a jump */

static uint32_t newest;

static sample_t *sample(uint32_t at)
{
    return &drive.samples.slot[at % SAMPLE_SLOTS];
}

/* All samples of the ring with the same current and dc voltage. */
void setUp(void)
{
    seam_start();
    newest = 1000;
    for (uint32_t n = 0; n < SAMPLE_SLOTS; n++) {
        drive.samples.slot[n] = (sample_t){.point.i = {-6000, 8000}, .v_dc = 16000, .acting = true};
    }
}

void tearDown(void)
{
}

static bool step(int32_t magnitude)
{
    const snapshot_t snapshot = {
        .sample.acting = sample(newest)->acting, .generation = newest, .i_magnitude = (q15_t)magnitude};
    return current_gain_has_jumped(&drive, &snapshot);
}

/* The currents are read 20 % too large from this sample on. */
static void jump_at(uint32_t at)
{
    for (uint32_t n = at; n <= newest + 2U * PERIODS; n++) {
        sample(n)->point.i = (dq_q15_t){-7200, 9600};
    }
}

/* Eight samples more must have been taken: a jump in one of the newest eight is found a step later. */
void test_a_jump_is_found_once_in_whatever_period_of_a_step_it_is(void)
{
    for (uint32_t n = 0; n <= PERIODS; n++) {
        setUp();
        const uint32_t first = newest - AFTER + 1U - PERIODS;
        jump_at(first + n);
        TEST_ASSERT_EQUAL(n < PERIODS, step(10000));
        newest += PERIODS;
        TEST_ASSERT_EQUAL(n == PERIODS, step(12000));
        newest += PERIODS;
        TEST_ASSERT_FALSE(step(12000));
    }
}

/* A change of 1200 counts in the last step: a jump of 2000 does not stand out. */
void test_what_the_current_did_in_the_step_before_counts(void)
{
    sample(newest - 10U)->point.i = (dq_q15_t){-6000, 9200};
    TEST_ASSERT_FALSE(step(10000));
    newest += PERIODS;
    jump_at(newest - 8U);
    TEST_ASSERT_FALSE(step(10000));
}

/* The same in the step of the jump: half of its 2000 counts. A smaller change after the largest one does not
 * replace it. */
void test_what_the_current_did_in_the_same_step_counts(void)
{
    for (int k = 0; k < 2; k++) {
        setUp();
        const uint32_t at = newest - 10U;
        jump_at(at);
        for (uint32_t n = newest - 30U; n < at - 1U; n++) {
            sample(n)->point.i.q += 998 + 4 * k;
        }
        for (uint32_t n = at + 2U; n <= newest; n++) {
            sample(n)->point.i.d += 900;
        }
        TEST_ASSERT_EQUAL(k == 0, step(10000));
        TEST_ASSERT_EQUAL_UINT16(245, drive.task.current_moved_q18); /* 1000^2/4096, rounded up */
    }
}

/* The change into the first sample of a step is its first one. */
void test_what_the_current_did_before_the_last_sample_of_the_step_before_does_not_count(void)
{
    jump_at(newest - 10U);
    for (uint32_t n = newest - 30U; n < newest - AFTER - PERIODS; n++) {
        sample(n)->point.i.q += 3000;
    }
    TEST_ASSERT_TRUE(step(10000));
}

/* 128^2 are four times 4096. */
void test_the_largest_change_is_kept_rounded_up(void)
{
    for (int more = 0; more < 2; more++) {
        setUp();
        sample(newest - 8U)->point.i.d += 256;
        sample(newest - 8U)->point.i.q += 2 * more;
        (void)step(10000);
        TEST_ASSERT_EQUAL_UINT16(4 + more, drive.task.current_moved_q18);
    }
}

/* 0.04 of full scale are 1311 counts. Nor does anything stand out in the first step after. */
void test_small_currents_are_not_compared(void)
{
    jump_at(newest - 9U);
    TEST_ASSERT_TRUE(step(1311));
    TEST_ASSERT_FALSE(step(1310));
    TEST_ASSERT_FALSE(step(10000));
    TEST_ASSERT_FALSE(step(10000)); /* the jump itself is now what the step before had */
    setUp();
    jump_at(newest - 9U);
    TEST_ASSERT_FALSE(step(1310));
    TEST_ASSERT_EQUAL_UINT16(UINT16_MAX, drive.task.current_moved_q18);
}

/* A 32nd of 16000 are 500; more, and the acting voltage was wrong. */
void test_a_jump_of_the_dc_voltage_explains_a_jump_of_the_current(void)
{
    static const struct {
        int32_t at, change;
        bool found;
    } cases[] = {{-3, 500, true},  {-3, 501, false}, {-3, -501, false}, {1, -500, true},
                 {1, -501, false}, {1, 501, false},  {-4, 900, true},   {2, 900, true}};
    for (unsigned n = 0; n < sizeof cases / sizeof cases[0]; n++) {
        setUp();
        const uint32_t at = newest - 10U;
        jump_at(at);
        sample(at + (uint32_t)cases[n].at)->v_dc += cases[n].change;
        TEST_ASSERT_EQUAL(cases[n].found, step(10000));
    }
}

void test_the_bridge_must_have_been_controlled(void)
{
    static const int32_t offsets[] = {-3, 0, 1};
    for (unsigned n = 0; n < sizeof offsets / sizeof offsets[0]; n++) {
        setUp();
        jump_at(newest - 10U);
        sample(newest - 10U + (uint32_t)offsets[n])->acting = false;
        TEST_ASSERT_FALSE(step(10000));
    }
    setUp();
    jump_at(newest - 10U);
    drive.request.current_mode = true; /* its references may jump */
    TEST_ASSERT_FALSE(step(10000));
    setUp();
    jump_at(newest - 10U);
    sample(newest)->acting = false;
    TEST_ASSERT_FALSE(step(10000));
}

/* The jump of 2000 counts; half of it is what a change after it may have. */
void test_a_current_that_is_not_quiet_after_it_has_not_jumped(void)
{
    static const struct {
        uint32_t after;
        int32_t change;
        bool found;
    } cases[] = {{1, 498, true},   {1, 502, false},  {2, 1000, true}, {2, 1004, false},
                 {7, 1004, false}, {8, 1004, false}, {9, 1500, true}};
    for (unsigned n = 0; n < sizeof cases / sizeof cases[0]; n++) {
        setUp();
        const uint32_t at = newest - 10U;
        jump_at(at);
        for (uint32_t k = at + cases[n].after; k <= newest; k++) {
            sample(k)->point.i.d += cases[n].change;
        }
        TEST_ASSERT_EQUAL(cases[n].found, step(10000));
    }
}

/* behind_gain moves the current by 1.5 of the jump: half of the jump in one of its three periods. */
void test_a_voltage_that_explains_the_jump_counts(void)
{
    const int32_t largest = (int32_t)(3000.0 * 65536.0 / seam.motor.plausibility.behind_gain);
    for (int k = 0; k < 2; k++) {
        setUp();
        const uint32_t at = newest - 10U;
        jump_at(at);
        sample(at - 1U)->point.u.q = largest + 20 * (2 * k - 1);
        TEST_ASSERT_EQUAL(k == 0, step(10000));
    }
    setUp();
    jump_at(newest - 10U);
    sample(newest - 12U)->point.u = sample(newest - 11U)->point.u = (dq_q15_t){largest, largest};
    TEST_ASSERT_TRUE(step(10000)); /* a voltage that has not changed drives no current */
}

/* A voltage that is limited moves the current, and so does the answer of current control to it. */
void test_a_limited_voltage_in_the_eight_periods_before_counts(void)
{
    for (uint32_t n = 0; n <= 9U; n++) {
        setUp();
        jump_at(newest - 10U);
        sample(newest - 10U - n)->pulses_clamped = true;
        TEST_ASSERT_EQUAL(n == 0U || n > 8U, step(10000));
        setUp();
        jump_at(newest - 10U);
        sample(newest - 10U - n)->voltage_limited = true;
        TEST_ASSERT_EQUAL(n == 0U || n > 8U, step(10000));
    }
}
