/* SPDX-License-Identifier: Apache-2.0 */
#include "fx/div.h"
#include "fx_vectors.h"
#include "unity.h"

void setUp(void)
{
}

void tearDown(void)
{
}

/* q = num * scale / den to nearest, exactly: num * scale - q * den lies in [-den/2, den/2).
 * At a saturated end the inequality that makes it saturate is checked instead. */
static void check(const char *what, int64_t num, int64_t den, int64_t scale, int64_t q, int64_t low, int64_t high)
{
    const int64_t n = (den < 0) ? -(num * scale) : (num * scale);
    const int64_t d = (den < 0) ? -den : den;
    const int64_t rest = n - (q * d);
    const bool rounded = (2 * rest >= -d) && (2 * rest < d);
    const bool clipped = ((q == high) && (rest >= 0)) || ((q == low) && (rest < 0));
    expect_equal(what, num, den, (rounded || clipped) ? q : INT64_MIN, q);
}

static void q31_pair(int32_t num, int32_t den)
{
    if (den != 0) {
        check("fx_div_q31", num, den, INT64_C(0x80000000), fx_div_q31(num, den), INT32_MIN, INT32_MAX);
    }
}

void test_quotients_of_q31_are_the_nearest_on_corners_and_at_random(void)
{
    for (int32_t i = 0; i < CORNERS; i++) {
        for (int32_t j = 0; j < CORNERS; j++) {
            q31_pair(corner[i], corner[j]);
        }
    }
    for (int32_t i = 0; i < 1000000; i++) {
        q31_pair(random_s32(), random_s32());
    }
}

/* Random denominators almost never need the second correction of a digit. These do: the upper half is small, the lower
 * half all ones, and the numerator just below. */
void test_quotients_are_exact_where_the_estimates_of_their_digits_are_worst(void)
{
    for (int32_t i = 0; i < 500000; i++) {
        const int32_t den = 0x40000000 + (int32_t)((random_u32() & 0xFU) << 16) + 0xFFFF;
        const int32_t num = den - 1 - (int32_t)(random_u32() & 0xFFFFU);
        q31_pair(num, den);
        q31_pair(-num, den >> (random_u32() % 16U));
        q31_pair(num >> (random_u32() % 31U), -den);
    }
}

void test_q31_quotients_at_the_ends_of_the_format_have_their_exact_values(void)
{
    TEST_ASSERT_EQUAL_INT32(6, fx_div_q31(3, 0x40000000)); /* 3 * 2^31 / 2^30 */
    TEST_ASSERT_EQUAL_INT32(1, fx_div_q31(1, INT32_MAX));
    TEST_ASSERT_EQUAL_INT32(-1, fx_div_q31(1, INT32_MIN));
    TEST_ASSERT_EQUAL_INT32(INT32_MAX, fx_div_q31(INT32_MIN, INT32_MIN));
    TEST_ASSERT_EQUAL_INT32(INT32_MIN, fx_div_q31(INT32_MIN, INT32_MAX));
    TEST_ASSERT_EQUAL_INT32(-INT32_MAX, fx_div_q31(INT32_MAX, INT32_MIN));
    /* (d - 1) / d for the largest d: 2^31 - 1 - 2^-31 */
    TEST_ASSERT_EQUAL_INT32(INT32_MAX, fx_div_q31(INT32_MAX - 1, INT32_MAX));
}

void test_division_by_zero_saturates_by_the_sign_of_the_numerator(void)
{
    TEST_ASSERT_EQUAL_INT32(INT32_MAX, fx_div_q31(1, 0));
    TEST_ASSERT_EQUAL_INT32(INT32_MIN, fx_div_q31(-1, 0));
    TEST_ASSERT_EQUAL_INT32(INT32_MIN, fx_div_q31(INT32_MIN, 0));
    TEST_ASSERT_EQUAL_INT32(0, fx_div_q31(0, 0));
    TEST_ASSERT_EQUAL_INT16(32767, fx_div_q15(1, 0));
    TEST_ASSERT_EQUAL_INT16(-32768, fx_div_q15(-1, 0));
    TEST_ASSERT_EQUAL_INT16(0, fx_div_q15(0, 0));
}

void test_q15_quotients_are_the_nearest_over_the_whole_plane(void)
{
    for (int32_t num = -32768; num <= 32767; num += 61) {
        for (int32_t den = -32768; den <= 32767; den += 67) {
            if (den != 0) {
                const q15_t q = fx_div_q15((q15_t)num, (q15_t)den);
                check("fx_div_q15", num, den, 32768, q, -32768, 32767);
            }
        }
    }
    for (int32_t i = 0; i < 2000000; i++) {
        const q15_t num = random_s16();
        const q15_t den = random_s16();
        if (den != 0) {
            check("fx_div_q15", num, den, 32768, fx_div_q15(num, den), -32768, 32767);
        }
    }
}

void test_q15_quotients_of_full_scale_saturate_only_beyond_the_format(void)
{
    TEST_ASSERT_EQUAL_INT16(Q15_MAX, fx_div_q15(Q15_MIN, Q15_MIN));
    TEST_ASSERT_EQUAL_INT16(Q15_MAX, fx_div_q15(Q15_MIN, -1));
    TEST_ASSERT_EQUAL_INT16(Q15_MIN, fx_div_q15(Q15_MIN, 32767));
    TEST_ASSERT_EQUAL_INT16(-32767, fx_div_q15(32767, Q15_MIN));
}

/* quotient * den <= num < (quotient + 1) * den, in 64 bits: the expected value needs no division. */
static void quotient(uint32_t num, uint32_t den)
{
    const uint32_t got = (uint32_t)fx_quotient(num, den);
    if (den == 0U) {
        expect_equal("fx_quotient", num, den, got, 0);
    } else {
        const uint64_t least = (uint64_t)got * den;
        expect_equal("fx_quotient", num, den, least <= num && num - least < den, 1);
    }
}

void test_the_quotient_of_words_is_truncated_and_zero_without_a_denominator(void)
{
    TEST_ASSERT_EQUAL_INT32(-1, fx_quotient(UINT32_MAX, 1U)); /* the bits of 2^32 - 1 */
    TEST_ASSERT_EQUAL_INT32(1, fx_quotient(UINT32_MAX, UINT32_MAX));
    TEST_ASSERT_EQUAL_INT32(0, fx_quotient(UINT32_MAX - 1U, UINT32_MAX));
    TEST_ASSERT_EQUAL_INT32(0, fx_quotient(0U, 0U));
    for (int32_t i = 0; i < CORNERS; i++) {
        for (int32_t j = 0; j < CORNERS; j++) {
            quotient((uint32_t)corner[i], (uint32_t)corner[j]);
        }
    }
    for (uint32_t den = 0U; den <= 65536U; den++) {
        quotient(UINT32_MAX, den);
        quotient(UINT32_C(0x80000000), den);
        quotient(random_u32(), den);
    }
    for (int32_t i = 0; i < 1000000; i++) {
        quotient((uint32_t)random_s32(), (uint32_t)random_s32());
        const uint32_t den = (uint32_t)random_s32();
        quotient((random_u32() % 65536U) * den, den); /* multiples of den */
        quotient((random_u32() % 65536U) * den - 1U, den);
    }
}
