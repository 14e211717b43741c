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
