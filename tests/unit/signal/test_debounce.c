/* SPDX-License-Identifier: Apache-2.0 */
#include "signal/debounce.h"
#include "unity.h"

void setUp(void)
{
}

void tearDown(void)
{
}

void test_a_condition_is_confirmed_in_the_last_of_its_samples_and_not_before(void)
{
    for (int samples = 1; samples <= 255; samples++) {
        uint8_t count = 0;
        for (int n = 1; n <= samples; n++) {
            TEST_ASSERT_EQUAL_HEX32((n == samples) ? 0x80000000U : 0U,
                                    debounce_step(&count, true, (uint8_t)samples, 0x80000000U));
        }
    }
}

void test_one_sample_without_the_condition_starts_the_count_again(void)
{
    uint8_t count = 0;
    for (int round = 0; round < 5; round++) {
        for (int n = 0; n < 4; n++) {
            TEST_ASSERT_EQUAL_HEX32(0, debounce_step(&count, true, 5, 4));
        }
        TEST_ASSERT_EQUAL_HEX32(0, debounce_step(&count, false, 5, 4));
        TEST_ASSERT_EQUAL_UINT8(0, count);
    }
}

/* The counter has 8 bits and must not wrap after 256 samples. */
void test_a_lasting_condition_stays_confirmed(void)
{
    uint8_t one = 0, longest = 0;
    for (int n = 1; n <= 1000; n++) {
        TEST_ASSERT_EQUAL_HEX32(2, debounce_step(&one, true, 1, 2));
        TEST_ASSERT_EQUAL_HEX32((n >= 255) ? 2U : 0U, debounce_step(&longest, true, 255, 2));
    }
    TEST_ASSERT_EQUAL_HEX32(0, debounce_step(&one, false, 1, 2));
}

void test_a_count_beyond_the_number_of_samples_is_limited_to_it(void)
{
    uint8_t count = 200;
    TEST_ASSERT_EQUAL_HEX32(1, debounce_step(&count, true, 3, 1));
    TEST_ASSERT_EQUAL_UINT8(3, count);
}
