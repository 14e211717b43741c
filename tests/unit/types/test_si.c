/* SPDX-License-Identifier: Apache-2.0 */
#include <math.h>

#include "types/si.h"
#include "unity.h"

void setUp(void)
{
}

void tearDown(void)
{
}

void test_a_count_stands_for_its_share_of_the_base(void)
{
    TEST_ASSERT_EQUAL_FLOAT(50.0F, si_from_q15(16384, 100.0F));
    TEST_ASSERT_EQUAL_FLOAT(-100.0F, si_from_q15(-32768, 100.0F));
    TEST_ASSERT_EQUAL_FLOAT(-0.25F, si_from_q31(-(1 << 29), 1.0F));
}

void test_each_q15_count_is_unchanged_after_conversion_to_si_and_back(void)
{
    for (int32_t x = -Q15_MAX; x <= Q15_MAX; x++) {
        TEST_ASSERT_EQUAL_INT(x, q15_from_si(si_from_q15(x, 237.7F), 237.7F));
    }
}

/* Single precision has 24 significant bits: 128 LSB of q31 near 1, rounded twice. */
void test_a_q31_count_is_kept_to_single_precision_after_conversion_to_si_and_back(void)
{
    for (int64_t x = -Q31_MAX; x <= Q31_MAX; x += 9999991) {
        TEST_ASSERT_INT32_WITHIN(256, (int32_t)x, q31_from_si(si_from_q31((int32_t)x, 0.0717F), 0.0717F));
    }
}

void test_conversion_rounds_to_the_nearest_count_and_halves_away_from_zero(void)
{
    TEST_ASSERT_EQUAL_INT(1, q15_from_si(0.5F, 32768.0F));
    TEST_ASSERT_EQUAL_INT(-1, q15_from_si(-0.5F, 32768.0F));
    TEST_ASSERT_EQUAL_INT(0, q15_from_si(0.49F, 32768.0F));
    TEST_ASSERT_EQUAL_INT(0, q15_from_si(-0.49F, 32768.0F));
}

void test_values_beyond_one_per_unit_saturate(void)
{
    const float beyond[] = {32767.6F, 32768.0F, 1e9F, INFINITY};
    for (unsigned k = 0; k < sizeof beyond / sizeof *beyond; k++) {
        TEST_ASSERT_EQUAL_INT(Q15_MAX, q15_from_si(beyond[k], 32768.0F));
    }
    TEST_ASSERT_EQUAL_INT(-Q15_MAX, q15_from_si(-32768.0F, 32768.0F));
    TEST_ASSERT_EQUAL_INT(-Q15_MAX, q15_from_si(-INFINITY, 32768.0F));
    TEST_ASSERT_EQUAL_INT(Q31_MAX, q31_from_si(1.0F, 1.0F));
    TEST_ASSERT_EQUAL_INT(-Q31_MAX, q31_from_si(-1.0F, 1.0F));
    TEST_ASSERT_EQUAL_INT(2147483520, q31_from_si(0.99999994F, 1.0F));
}

void test_nan_becomes_the_most_negative_count(void)
{
    TEST_ASSERT_EQUAL_INT(-Q15_MAX, q15_from_si(NAN, 1.0F));
    TEST_ASSERT_EQUAL_INT(-Q31_MAX, q31_from_si(NAN, 1.0F));
}
