/* SPDX-License-Identifier: Apache-2.0 */
#include <math.h>

#include "fx/q.h"
#include "fx_vectors.h"
#include "unity.h"

#define TWO32 4294967296.0L

void setUp(void)
{
}

void tearDown(void)
{
}

/* The residue in int32_t that wraps as the header says; x is an integer. */
static int64_t wrapped(long double x)
{
    const long double turns = floorl((x + 2147483648.0L) / TWO32);
    return (int64_t)(x - (turns * TWO32));
}

static void q15_pair(int32_t a, int32_t b)
{
    const q15_t x = (q15_t)a;
    const q15_t y = (q15_t)b;
    const long double product = (long double)a * b;
    const int64_t rounded = (int64_t)clip(half_up(product / 32768.0L), -32768.0L, 32767.0L);
    expect_equal("fx_mul_q30", a, b, fx_mul_q30(x, y), (int64_t)product);
    expect_equal("fx_mul_q15", a, b, fx_mul_q15(x, y), rounded);
}

void test_minus_one_squared_saturates_in_every_format(void)
{
    TEST_ASSERT_EQUAL_INT16(Q15_MAX, fx_mul_q15(Q15_MIN, Q15_MIN));
    TEST_ASSERT_EQUAL_INT32(Q31_MAX, fx_mul_q31(Q31_MIN, Q31_MIN));
    TEST_ASSERT_EQUAL_INT32(0x40000000, fx_mul_q30(Q15_MIN, Q15_MIN));
    TEST_ASSERT_EQUAL_INT32(0x40000000, fx_mulhi(Q31_MIN, Q31_MIN));
    TEST_ASSERT_EQUAL_INT16(Q15_MAX, fx_mul_gain_q15(-Q16_ONE, Q15_MIN));
    TEST_ASSERT_EQUAL_INT32(Q31_MAX, fx_mul_gain_q31(-Q16_ONE, Q31_MIN));
}

void test_one_step_inside_minus_one_squared_does_not_saturate(void)
{
    /* 32767 * 32768 / 32768 = 32767 exactly: the largest result, reached without saturation. */
    TEST_ASSERT_EQUAL_INT16(32767, fx_mul_q15(-32767, Q15_MIN));
    TEST_ASSERT_EQUAL_INT16(-32767, fx_mul_q15(32767, Q15_MIN));
    TEST_ASSERT_EQUAL_INT32(INT32_MAX, fx_mul_q31(-INT32_MAX, Q31_MIN));
    TEST_ASSERT_EQUAL_INT32(-INT32_MAX, fx_mul_q31(INT32_MAX, Q31_MIN));
    /* (2^31 - 1)^2 / 2^31 = 2^31 - 2 + 2^-31 */
    TEST_ASSERT_EQUAL_INT32(INT32_MAX - 1, fx_mul_q31(INT32_MAX, INT32_MAX));
}

void test_q15_products_are_exact_and_round_half_up(void)
{
    for (int32_t a = -32768; a <= 32767; a += 97) {
        for (int32_t b = -32768; b <= 32767; b += 89) {
            q15_pair(a, b);
        }
    }
    for (int32_t a = -32768; a <= 32767; a++) {
        q15_pair(a, -32768);
        q15_pair(a, 32767);
        q15_pair(a, 16384); /* every second product is a tie */
        q15_pair(a, -1);
    }
}

static void q31_pair(int32_t a, int32_t b)
{
    const long double product = (long double)a * b; /* 62 bits, exact */
    const int64_t high = (int64_t)half_up(product / TWO32);
    const int64_t q31 = (int64_t)clip(half_up(product / 2147483648.0L), INT32_MIN, INT32_MAX);
    expect_equal("fx_mulhi", a, b, fx_mulhi(a, b), high);
    expect_equal("fx_mul_q31", a, b, fx_mul_q31(a, b), q31);
    const int64_t gain = (int64_t)clip(half_up(product / 65536.0L), INT32_MIN, INT32_MAX);
    expect_equal("fx_mul_gain_q31", a, b, fx_mul_gain_q31(a, b), gain);
}

static void accumulate(int32_t acc, int32_t a, int32_t b)
{
    const long double product = (long double)a * b / TWO32;
    /* Rounding the sum is the same as rounding the product, because the accumulator is an integer. */
    expect_equal("fx_mulhi_add", a, b, fx_mulhi_add(acc, a, b), wrapped(acc + half_up(product)));
    expect_equal("fx_mulhi_sub", a, b, fx_mulhi_sub(acc, a, b), wrapped(acc + half_up(-product)));
}

void test_q31_products_agree_with_long_double_on_corners_and_at_random(void)
{
    for (int32_t i = 0; i < CORNERS; i++) {
        for (int32_t j = 0; j < CORNERS; j++) {
            q31_pair(corner[i], corner[j]);
            accumulate(corner[(i + j) % CORNERS], corner[i], corner[j]);
        }
    }
    for (int32_t i = 0; i < 1000000; i++) {
        q31_pair(random_s32(), random_s32());
        accumulate(random_s32(), random_s32(), random_s32());
    }
}

void test_subtracting_a_tie_rounds_the_difference_up_and_not_the_product(void)
{
    /* 2^31 / 2^32 = 1/2: 10 + 1/2 -> 11, 10 - 1/2 -> 10 */
    TEST_ASSERT_EQUAL_INT32(11, fx_mulhi_add(10, 0x40000000, 2));
    TEST_ASSERT_EQUAL_INT32(10, fx_mulhi_sub(10, 0x40000000, 2));
}

static void gain_q15(int32_t a, int32_t b)
{
    const q15_t x = (q15_t)b;
    const long double product = (long double)a * x;
    const int64_t gain = (int64_t)clip(half_up(product / 65536.0L), -32768.0L, 32767.0L);
    expect_equal("fx_mul_gain_q15", a, x, fx_mul_gain_q15(a, x), gain);
    expect_equal("fx_mul_gain_q15_word", a, x, fx_mul_gain_q15_word(a, x), gain);
}

void test_gains_of_q15_round_half_up_and_saturate(void)
{
    for (int32_t i = 0; i < CORNERS; i++) {
        for (int32_t j = 0; j < CORNERS; j++) {
            gain_q15(corner[i], corner[j] >> 16);
        }
    }
    for (int32_t i = 0; i < 1000000; i++) {
        gain_q15(random_s32(), random_s16());
    }
}

/* The lower half of b as a signed number; the products ignore the upper half. */
static int32_t lower_half(int32_t b)
{
    const int32_t low = (int32_t)((uint32_t)b % 65536U);
    return (low < 32768) ? low : low - 65536;
}

static void word(int32_t acc, int32_t a, int32_t b)
{
    const long double cut = floorl((long double)a * lower_half(b) / 65536.0L);
    expect_equal("fx_mul_q31_word", a, b, fx_mul_q31_word(a, b), (int64_t)cut);
    expect_equal("fx_mac_q31_word", a, b, fx_mac_q31_word(acc, a, b), wrapped(acc + cut));
}

void test_products_with_the_lower_half_of_a_word_truncate_and_ignore_the_upper_half(void)
{
    TEST_ASSERT_EQUAL_INT32(0x40000000, fx_mul_q31_word(Q31_MIN, Q15_MIN)); /* -1 * -1 = 1 in Q30 */
    TEST_ASSERT_EQUAL_INT32(-1, fx_mul_q31_word(-1, 1));                    /* towards minus infinity */
    TEST_ASSERT_EQUAL_INT32(INT32_MIN, fx_mac_q31_word(INT32_MAX, 65536, 1));
    for (int32_t i = 0; i < CORNERS; i++) {
        for (int32_t j = 0; j < CORNERS; j++) {
            for (int32_t k = 0; k < CORNERS; k++) {
                word(corner[k], corner[i], corner[j]);
            }
        }
    }
    for (int32_t b = -32768; b <= 32767; b++) {
        word(random_s32(), Q31_MIN, b);
        word(random_s32(), Q31_MAX, b);
        word(random_s32(), random_s32(), b);
    }
    for (int32_t i = 0; i < 1000000; i++) {
        word(random_s32(), random_s32(), (int32_t)random_u32());
    }
}

static void dual(const q15_t v[4], int32_t acc)
{
    const fx_pair_t a = fx_pair(v[0], v[1]);
    const fx_pair_t b = fx_pair(v[2], v[3]);
    const long double dot = ((long double)v[0] * v[2]) + ((long double)v[1] * v[3]);
    expect_equal("fx_pair", v[0], v[1], (int64_t)a,
                 ((int64_t)v[1] < 0 ? v[1] + INT64_C(65536) : v[1]) * 65536 +
                     (v[0] < 0 ? v[0] + INT64_C(65536) : v[0]));
    expect_equal("fx_dot2", v[0], v[1], fx_dot2(a, b), wrapped(dot));
    expect_equal("fx_dot2_acc", v[0], v[1], fx_dot2_acc(acc, a, b), wrapped(acc + dot));
    const long double crossed = ((long double)v[0] * v[3]) + ((long double)v[1] * v[2]);
    expect_equal("fx_dot2_cross", v[0], v[1], fx_dot2_cross(a, b), wrapped(crossed));
    const long double difference = ((long double)v[0] * v[2]) - ((long double)v[1] * v[3]);
    expect_equal("fx_difference2", v[0], v[1], fx_difference2(a, b), (int64_t)difference);
    const long double crossed_difference = ((long double)v[0] * v[3]) - ((long double)v[1] * v[2]);
    expect_equal("fx_difference2_cross_acc", v[0], v[1], fx_difference2_cross_acc(acc, a, b),
                 wrapped(acc + crossed_difference));
    expect_equal("fx_pair_sub", v[0], v[1], (int64_t)fx_pair_sub(a, b),
                 (int64_t)fx_pair(fx_sat_q15_word(v[0] - v[2]), fx_sat_q15_word(v[1] - v[3])));
    const int32_t one_by_one = fx_mac_q30(fx_mac_q30(acc, v[0], v[2]), v[1], v[3]);
    expect_equal("fx_mac_q30", v[0], v[1], one_by_one, wrapped(acc + dot));
}

void test_dual_products_equal_two_single_ones_and_wrap_as_documented(void)
{
    const q15_t all_minus_one[4] = {Q15_MIN, Q15_MIN, Q15_MIN, Q15_MIN};
    TEST_ASSERT_EQUAL_INT32(INT32_MIN, fx_dot2(fx_pair(Q15_MIN, Q15_MIN), fx_pair(Q15_MIN, Q15_MIN)));
    dual(all_minus_one, INT32_MAX);
    dual(all_minus_one, INT32_MIN);
    static const q15_t end[7] = {Q15_MIN, -32767, -1, 0, 1, 16384, Q15_MAX};
    for (int32_t i = 0; i < 7 * 7 * 7 * 7; i++) {
        const q15_t v[4] = {end[i % 7], end[i / 7 % 7], end[i / 49 % 7], end[i / 343]};
        dual(v, corner[i % CORNERS]);
    }
    for (int32_t i = 0; i < 1000000; i++) {
        const q15_t v[4] = {random_s16(), random_s16(), random_s16(), random_s16()};
        dual(v, random_s32());
    }
}
