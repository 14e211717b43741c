/* SPDX-License-Identifier: Apache-2.0 */
#include "signal/rate_limit.h"
#include "unity.h"

void setUp(void)
{
}

void tearDown(void)
{
}

void test_a_step_becomes_a_ramp_of_the_rate_in_both_directions(void)
{
    q15_t up = 0;
    q15_t down = 0;
    for (int n = 1; n <= 10; n++) {
        up = rate_limit_step(up, 1000, 100);
        down = rate_limit_step(down, -1000, 100);
        TEST_ASSERT_EQUAL_INT(100 * n, up);
        TEST_ASSERT_EQUAL_INT(-100 * n, down);
    }
    TEST_ASSERT_EQUAL_INT(1000, rate_limit_step(up, 1000, 100));
    TEST_ASSERT_EQUAL_INT(-1000, rate_limit_step(down, -1000, 100));
}

void test_a_target_within_the_rate_is_reached_exactly(void)
{
    TEST_ASSERT_EQUAL_INT(7, rate_limit_step(0, 7, 7));
    TEST_ASSERT_EQUAL_INT(7, rate_limit_step(0, 8, 7));
    TEST_ASSERT_EQUAL_INT(-7, rate_limit_step(0, -7, 7));
    TEST_ASSERT_EQUAL_INT(-7, rate_limit_step(0, -8, 7));
}

void test_a_rate_of_q15_max_does_not_limit_even_the_largest_step(void)
{
    TEST_ASSERT_EQUAL_INT(INT16_MAX, rate_limit_step(INT16_MIN, INT16_MAX, Q15_MAX));
    TEST_ASSERT_EQUAL_INT(INT16_MIN, rate_limit_step(INT16_MAX, INT16_MIN, Q15_MAX));
}

/* The difference of the ends does not fit q15: a subtraction in 16 bits would reverse the direction. */
void test_the_largest_step_with_a_limit_has_the_right_direction(void)
{
    TEST_ASSERT_EQUAL_INT(INT16_MIN + 32766, rate_limit_step(INT16_MIN, INT16_MAX, 32766));
    TEST_ASSERT_EQUAL_INT(INT16_MAX - 32766, rate_limit_step(INT16_MAX, INT16_MIN, 32766));
    TEST_ASSERT_EQUAL_INT(INT16_MIN + 1, rate_limit_step(INT16_MIN, INT16_MAX, 1));
}

void test_a_rate_of_zero_keeps_the_value(void)
{
    TEST_ASSERT_EQUAL_INT(-5, rate_limit_step(-5, 32767, 0));
}

void test_the_output_never_passes_the_target_and_never_changes_faster_than_the_rate(void)
{
    for (int last = -32768; last <= 32767; last += 641) {
        for (int target = -32768; target <= 32767; target += 643) {
            for (int rate = 0; rate < 32767; rate += 4095) {
                const int y = rate_limit_step((q15_t)last, (q15_t)target, (q15_t)rate);
                const int distance = (target > last) ? target - last : last - target;
                const int change = (y > last) ? y - last : last - y;
                TEST_ASSERT_EQUAL_INT((distance < rate) ? distance : rate, change);
                TEST_ASSERT_TRUE((target >= last) ? (y >= last && y <= target) : (y <= last && y >= target));
            }
        }
    }
}
