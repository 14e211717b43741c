/* SPDX-License-Identifier: Apache-2.0 */
#include "signal/step_clock.h"
#include "unity.h"

static step_clock_t clock_;

void setUp(void)
{
}

void tearDown(void)
{
}

void test_at_10_kHz_every_step_is_one_millisecond(void)
{
    step_clock_start(&clock_, 1000000U);
    for (uint32_t n = 1; n <= 5000U; n++) {
        step_clock_step(&clock_);
        TEST_ASSERT_EQUAL_UINT32(1000, clock_.elapsed_us);
        TEST_ASSERT_EQUAL_UINT32(1, clock_.passed_ms);
        TEST_ASSERT_EQUAL_UINT32(n, clock_.ms);
    }
}

/* Step lengths at PWM frequencies of 4.5, 5.5, 22.5, 10.5, 4.4999 and 8.9 kHz, against the exact sum of the steps. */
void test_for_an_hour_the_clock_equals_the_exact_sum_of_the_steps(void)
{
    static const uint32_t step_ns[] = {888889U, 1090909U, 977778U, 1047619U, 1111136U, 1011236U};
    for (unsigned k = 0; k < sizeof step_ns / sizeof step_ns[0]; k++) {
        uint64_t us = 0, exact_ns = 0;
        step_clock_start(&clock_, step_ns[k]);
        for (int n = 0; n < 3600000; n++) {
            step_clock_step(&clock_);
            exact_ns += step_ns[k];
            us += clock_.elapsed_us;
            TEST_ASSERT_TRUE(us == exact_ns / 1000U && clock_.ms == exact_ns / 1000000U);
        }
    }
}

void test_no_millisecond_is_lost_or_counted_twice(void)
{
    for (uint32_t ns = 800000U; ns <= 1250000U; ns += 4093U) {
        uint32_t ms = 0;
        step_clock_start(&clock_, ns);
        for (int n = 0; n < 1000; n++) {
            step_clock_step(&clock_);
            ms += clock_.passed_ms;
            TEST_ASSERT_TRUE(clock_.passed_ms <= 2U && ms == clock_.ms);
        }
    }
}

/* With damaged motor data time must still pass, so that the bus reports the fault. */
void test_a_step_length_out_of_range_counts_as_a_millisecond(void)
{
    static const uint32_t bad[] = {0U, 799999U, 1250001U, 4294967295U};
    for (unsigned k = 0; k < sizeof bad / sizeof bad[0]; k++) {
        step_clock_start(&clock_, bad[k]);
        step_clock_step(&clock_);
        TEST_ASSERT_EQUAL_UINT32(1000, clock_.elapsed_us);
    }
}

void test_the_count_of_milliseconds_wraps(void)
{
    step_clock_start(&clock_, 1125000U);
    clock_.ms = UINT32_MAX;
    clock_.rest_us = 900U;
    step_clock_step(&clock_);
    TEST_ASSERT_EQUAL_UINT32(2, clock_.passed_ms);
    TEST_ASSERT_EQUAL_UINT32(1, clock_.ms);
}
