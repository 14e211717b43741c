/* SPDX-License-Identifier: Apache-2.0 */
#include "signal/mean.h"

#include <math.h>

#include "unity.h"

void setUp(void)
{
}

void tearDown(void)
{
}

void test_a_step_is_followed_with_the_share_of_the_shift(void)
{
    for (int shift = 0; shift <= 12; shift++) {
        int32_t mean = 0;
        for (int n = 1; n <= 3 << shift; n++) {
            mean = mean_step(mean, 1 << 24, shift);
            const double exact = (1.0 - pow(1.0 - ldexp(1.0, -shift), n)) * 16777216.0;
            TEST_ASSERT_INT32_WITHIN(1 << shift, (int32_t)lround(exact), mean);
        }
    }
}

/* Rounding down: from above the mean arrives, from below it stays less than 2^shift away. */
void test_the_mean_of_a_constant_ends_less_than_two_to_the_shift_below_it(void)
{
    for (int shift = 0; shift <= 12; shift++) {
        int32_t falling = 1 << 20, rising = -(1 << 20);
        for (int n = 0; n < 20 << shift; n++) {
            falling = mean_step(falling, 77, shift);
            rising = mean_step(rising, 77, shift);
        }
        TEST_ASSERT_EQUAL_INT32(77, falling);
        TEST_ASSERT_EQUAL_INT32(77 - ((1 << shift) - 1), rising);
    }
}

void test_a_value_is_followed_at_a_rate_to_half_a_count_of_it(void)
{
    for (int sign = -1; sign <= 1; sign += 2) {
        q15_t mean = 0;
        for (int n = 1; n <= 100; n++) {
            mean = mean_follow(mean, sign * 20000, Q15(0.125));
            TEST_ASSERT_INT_WITHIN(5, (int)lround(sign * 20000.0 * (1.0 - pow(0.875, n))), mean);
        }
    }
    TEST_ASSERT_EQUAL_INT(-1234, mean_follow(77, -1234, Q15_MAX));
    TEST_ASSERT_EQUAL_INT(INT16_MIN, mean_follow(0, -40000, Q15_MAX));
    TEST_ASSERT_EQUAL_INT(100, mean_follow(100, 30000, 0));
}
