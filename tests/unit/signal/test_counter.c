/* SPDX-License-Identifier: Apache-2.0 */
#include "signal/counter.h"
#include "unity.h"

void setUp(void)
{
}

void tearDown(void)
{
}

void test_every_event_adds_one_up_to_the_largest_value(void)
{
    TEST_ASSERT_EQUAL_UINT32(1, count_up_to(0, 3));
    TEST_ASSERT_EQUAL_UINT32(3, count_up_to(2, 3));
    TEST_ASSERT_EQUAL_UINT32(3, count_up_to(3, 3));
    TEST_ASSERT_EQUAL_UINT32(UINT32_MAX, count_up_to(UINT32_MAX, UINT32_MAX));
}

void test_a_count_above_the_largest_value_is_limited_to_it(void)
{
    TEST_ASSERT_EQUAL_UINT32(255, count_up_to(1000, 255));
}

void test_a_counter_of_16_bits_does_not_wrap(void)
{
    uint16_t counter = 0;
    for (uint32_t n = 1; n <= 70000U; n++) {
        count_up(&counter);
        TEST_ASSERT_EQUAL_UINT16((n < 65535U) ? n : 65535U, counter);
    }
}
