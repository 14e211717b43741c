/* SPDX-License-Identifier: Apache-2.0 */
#if defined(__OPTIMIZE__) && defined(__GNUC__) && !defined(__clang__)
#pragma GCC optimize("O3") /* 2^33 sums: with -O2 the loop takes twice as long */
#endif

#include <math.h>

#include "fx/codegen.h"
#include "fx/q.h"
#include "fx_vectors.h"
#include "unity.h"

void setUp(void)
{
}

void tearDown(void)
{
}

/* The number of b in [from, to] for which f(a, b) is not a + slope * b, or not the constant a. */
#define COUNT_WRONG(f, a, from, to, expected) \
    do { \
        for (int32_t b = (from); b <= (to); b++) { \
            wrong += ((f)((q15_t)(a), (q15_t)b) != (expected)) ? 1 : 0; \
        } \
    } while (0)

static int32_t smaller(int32_t a, int32_t b)
{
    return (a < b) ? a : b;
}

static int32_t larger(int32_t a, int32_t b)
{
    return (a > b) ? a : b;
}

/* While b rises at a constant a, the sum is first the minimum, then a + b, then the maximum. The expected values follow
 * from this order, not from the formula of a limit. */
void test_adding_is_exact_or_saturated_for_every_pair_of_q15(void)
{
    const int32_t stride = exhaustive_is_affordable() ? 1 : 251;
    for (int32_t a = -32768; a <= 32767; a += stride) {
        const int32_t first = larger(-32768 - a, -32768);
        const int32_t last = smaller(32767 - a, 32767);
        int32_t wrong = 0;
        COUNT_WRONG(fx_add_q15, a, -32768, first - 1, -32768);
        COUNT_WRONG(fx_add_q15, a, first, last, a + b);
        COUNT_WRONG(fx_add_q15, a, last + 1, 32767, 32767);
        TEST_ASSERT_EQUAL_INT32_MESSAGE(0, wrong, "wrong sums");
    }
}

void test_negation_and_magnitude_of_every_q15_saturate_only_at_minus_one(void)
{
    TEST_ASSERT_EQUAL_INT16(32767, fx_neg_q15(Q15_MIN));
    TEST_ASSERT_EQUAL_INT16(32767, fx_abs_q15(Q15_MIN));
    for (int32_t a = -32767; a <= 32767; a++) {
        expect_equal("fx_neg_q15", a, 0, fx_neg_q15((q15_t)a), -a);
        expect_equal("fx_abs_q15", a, 0, fx_abs_q15((q15_t)a), (a < 0) ? -a : a);
    }
}

void test_saturation_to_q15_changes_only_values_beyond_the_range(void)
{
    for (int32_t x = -32768; x <= 32767; x++) {
        expect_equal("fx_sat_q15", x, 0, fx_sat_q15(x), x);
    }
    for (int32_t i = 0; i < 1000000; i++) {
        const int32_t x = (i < CORNERS) ? corner[i] : random_s32();
        expect_equal("fx_sat_q15", x, 0, fx_sat_q15(x), (int64_t)clip(x, -32768.0L, 32767.0L));
        expect_equal("fx_sat_q15_word", x, 0, fx_sat_q15_word(x), (int64_t)clip(x, -32768.0L, 32767.0L));
        expect_equal("fx_usat_q15_word", x, 0, fx_usat_q15_word(x), (int64_t)clip(x, 0.0L, 32767.0L));
    }
}

/* The width is part of an instruction, so each needs a line of its own: the ends and those that the firmware uses. */
#define CHECK_SIGNED(x, bits) \
    expect_equal("fx_sat_bits", x, bits, fx_sat_bits((x), (bits)), \
                 (int64_t)clip((x), -ldexpl(1.0L, (bits)-1), ldexpl(1.0L, (bits)-1) - 1.0L))
#define CHECK_UNSIGNED(x, bits) \
    expect_equal("fx_usat_bits", x, bits, fx_usat_bits((x), (bits)), \
                 (int64_t)clip((x), 0.0L, ldexpl(1.0L, (bits)) - 1.0L))

static void saturate_to_bits(int32_t x)
{
    CHECK_SIGNED(x, 1);
    CHECK_SIGNED(x, 2);
    CHECK_SIGNED(x, 16);
    CHECK_SIGNED(x, 23);
    CHECK_SIGNED(x, 24);
    CHECK_SIGNED(x, 26);
    CHECK_SIGNED(x, 30);
    CHECK_SIGNED(x, 31);
    CHECK_SIGNED(x, 32);
    CHECK_UNSIGNED(x, 0);
    CHECK_UNSIGNED(x, 1);
    CHECK_UNSIGNED(x, 17);
    CHECK_UNSIGNED(x, 22);
    CHECK_UNSIGNED(x, 31);
}

void test_saturation_to_a_number_of_bits_changes_only_values_beyond_the_range(void)
{
    for (int32_t i = 0; i < CORNERS; i++) {
        saturate_to_bits(corner[i]);
    }
    for (int32_t n = 0; n < 31; n++) {
        for (int32_t offset = -2; offset <= 2; offset++) {
            saturate_to_bits((int32_t)((1U << n) + (uint32_t)offset));
            saturate_to_bits(-(int32_t)((1U << n) + (uint32_t)offset));
        }
    }
    for (int32_t i = 0; i < 200000; i++) {
        saturate_to_bits(random_s32());
    }
}

void test_saturation_to_q31_changes_only_values_beyond_the_range(void)
{
    TEST_ASSERT_EQUAL_INT32(INT32_MAX, fx_sat_q31(INT64_MAX));
    TEST_ASSERT_EQUAL_INT32(INT32_MIN, fx_sat_q31(INT64_MIN));
    TEST_ASSERT_EQUAL_INT32(INT32_MAX, fx_sat_q31(INT64_C(0x80000000)));
    TEST_ASSERT_EQUAL_INT32(INT32_MIN, fx_sat_q31(INT64_C(-0x80000001)));
    TEST_ASSERT_EQUAL_INT32(INT32_MAX, fx_sat_q31(INT64_C(0xFFFFFFFF)));
    for (int32_t i = 0; i < 1000000; i++) {
        const int64_t x = ((int64_t)random_s32() * 8) + (random_s32() % 8);
        const int64_t want = (x > INT32_MAX) ? INT32_MAX : (x < INT32_MIN) ? INT32_MIN : x;
        expect_equal("fx_sat_q31", x, 0, fx_sat_q31(x), want);
    }
}

static void q31_pair(int32_t a, int32_t b)
{
    const long double sum = clip((long double)a + b, INT32_MIN, INT32_MAX);
    const long double difference = clip((long double)a - b, INT32_MIN, INT32_MAX);
    expect_equal("fx_add_q31", a, b, fx_add_q31(a, b), (int64_t)sum);
    expect_equal("fx_sub_q31", a, b, fx_sub_q31(a, b), (int64_t)difference);
    const long double twice = clip((long double)b + b, INT32_MIN, INT32_MAX);
    expect_equal("fx_add2_q31", a, b, fx_add2_q31(a, b), (int64_t)clip(a + twice, INT32_MIN, INT32_MAX));
    expect_equal("fx_add_wrap", a, b, fx_add_wrap(a, b), (int32_t)((uint32_t)a + (uint32_t)b));
    expect_equal("fx_sub_wrap", a, b, fx_sub_wrap(a, b), (int32_t)((uint32_t)a - (uint32_t)b));
    expect_equal("fx_min_s32", a, b, fx_min_s32(a, b), (int64_t)fminl(a, b));
    expect_equal("fx_max_s32", a, b, fx_max_s32(a, b), (int64_t)fmaxl(a, b));
}

void test_q31_sums_and_extremes_agree_with_long_double(void)
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

/* The functions of fx/codegen.h influence the choice of instructions only. */
static void words_unchanged(int32_t a, int32_t b)
{
    const struct {
        int32_t before, a, b, after;
    } at = {~a, a, b, ~b};
    fx_two_words_t two = FX_LOAD_TWO(&at, a, b);
    fx_both_loaded(&two.first, &two.second);
    expect_equal("FX_LOAD_TWO, first", a, b, two.first, a);
    expect_equal("FX_LOAD_TWO, second", a, b, two.second, b);
    const int32_t pair[3] = {~a, a, b};
    expect_equal("fx_load_two_words", a, b, fx_load_two_words(&pair[1]).second, b);
    const volatile uint32_t registers[3] = {~(uint32_t)a, (uint32_t)a, (uint32_t)b};
    expect_equal("fx_read_two, first", a, b, fx_read_two(&registers[1]).first, a);
    expect_equal("fx_read_two, second", a, b, fx_read_two(&registers[1]).second, b);
    expect_equal("fx_in_register", a, b, fx_in_register(a), a);
}

void test_the_functions_that_choose_instructions_change_no_value(void)
{
    for (int32_t i = 0; i < CORNERS; i++) {
        for (int32_t j = 0; j < CORNERS; j++) {
            words_unchanged(corner[i], corner[j]);
        }
    }
}

void test_q31_negation_and_magnitude_saturate_only_at_minus_one(void)
{
    TEST_ASSERT_EQUAL_INT32(INT32_MAX, fx_neg_q31(INT32_MIN));
    TEST_ASSERT_EQUAL_INT32(INT32_MAX, fx_abs_q31(INT32_MIN));
    for (int32_t i = 1; i < 100000; i++) {
        const int32_t a = (i < CORNERS) ? corner[i] : random_s32();
        if (a != INT32_MIN) {
            expect_equal("fx_neg_q31", a, 0, fx_neg_q31(a), -(int64_t)a);
            expect_equal("fx_abs_q31", a, 0, fx_abs_q31(a), (a < 0) ? -(int64_t)a : a);
        }
    }
}

void test_the_ones_magnitude_of_a_negative_number_is_one_too_small(void)
{
    TEST_ASSERT_EQUAL_INT32(INT32_MAX, fx_ones_magnitude(INT32_MAX));
    TEST_ASSERT_EQUAL_INT32(INT32_MAX, fx_ones_magnitude(INT32_MIN));
    TEST_ASSERT_EQUAL_INT32(0, fx_ones_magnitude(0));
    TEST_ASSERT_EQUAL_INT32(0, fx_ones_magnitude(-1));
    TEST_ASSERT_EQUAL_INT32(7, fx_ones_magnitude(7));
    TEST_ASSERT_EQUAL_INT32(6, fx_ones_magnitude(-7));
}

void test_narrowing_rounds_half_up_and_never_wraps_over_all_of_int32(void)
{
    TEST_ASSERT_EQUAL_INT16(32767, fx_round_q15(INT32_MAX));
    TEST_ASSERT_EQUAL_INT16(-32768, fx_round_q15(INT32_MIN));
    TEST_ASSERT_EQUAL_INT16(1, fx_round_q15(0x4000));   /* +1/2 LSB */
    TEST_ASSERT_EQUAL_INT16(0, fx_round_q15(-0x4000));  /* -1/2 LSB */
    TEST_ASSERT_EQUAL_INT16(-1, fx_round_q15(-0x4001)); /* one count below -1/2 LSB */
    TEST_ASSERT_EQUAL_INT16(32767, fx_q15_from_q31(INT32_MAX));
    for (int32_t i = 0; i < 2000000; i++) {
        const int32_t x = (i < CORNERS) ? corner[i] : random_s32();
        const long double q15 = clip(half_up(x / 32768.0L), -32768.0L, 32767.0L);
        const long double q31 = clip(half_up(x / 65536.0L), -32768.0L, 32767.0L);
        expect_equal("fx_round_q15", x, 0, fx_round_q15(x), (int64_t)q15);
        expect_equal("fx_round_q15_word", x, 0, fx_round_q15_word(x), (int64_t)q15);
        expect_equal("fx_q15_from_q31", x, 0, fx_q15_from_q31(x), (int64_t)q31);
    }
}

void test_every_q15_is_the_same_after_conversion_to_q31_and_back(void)
{
    for (int32_t x = -32768; x <= 32767; x++) {
        expect_equal("fx_q31_from_q15", x, 0, fx_q31_from_q15((q15_t)x), (int64_t)x * 65536);
        expect_equal("back", x, 0, fx_q15_from_q31(fx_q31_from_q15((q15_t)x)), x);
    }
}

void test_a_clamp_keeps_values_between_its_limits_and_gives_the_upper_one_if_they_are_crossed(void)
{
    TEST_ASSERT_EQUAL_INT16(-5, fx_clamp_q15(-5, -10, 10));
    TEST_ASSERT_EQUAL_INT16(-10, fx_clamp_q15(Q15_MIN, -10, 10));
    TEST_ASSERT_EQUAL_INT16(10, fx_clamp_q15(Q15_MAX, -10, 10));
    TEST_ASSERT_EQUAL_INT16(-10, fx_clamp_q15(0, 10, -10));
    TEST_ASSERT_EQUAL_INT32(INT32_MIN, fx_clamp_q31(INT32_MIN, INT32_MIN, INT32_MAX));
    TEST_ASSERT_EQUAL_INT32(7, fx_clamp_q31(INT32_MIN, 7, INT32_MAX));
    TEST_ASSERT_EQUAL_INT32(-7, fx_clamp_q31(INT32_MAX, INT32_MIN, -7));
}

static void shift_both_ways(int32_t x, unsigned n)
{
    const long double scale = ldexpl(1.0L, (int)n);
    const long double up = clip(x * scale, INT32_MIN, INT32_MAX);
    expect_equal("fx_shl_q31", x, n, fx_shl_q31(x, n), (int64_t)up);
    expect_equal("fx_shr_round", x, n, fx_shr_round(x, n), (int64_t)half_up(x / scale));
}

/* Up to 40: beyond the width of the word a plain shift is undefined in C. */
void test_shifts_of_any_count_saturate_upwards_and_round_half_up_downwards(void)
{
    for (unsigned n = 0U; n <= 40U; n++) {
        for (int32_t i = 0; i < CORNERS; i++) {
            shift_both_ways(corner[i], n);
        }
        for (int32_t i = 0; i < 50000; i++) {
            shift_both_ways(random_s32(), n);
        }
    }
    TEST_ASSERT_EQUAL_INT32(0, fx_shr_round(INT32_MIN, UINT32_MAX));
    TEST_ASSERT_EQUAL_INT32(INT32_MIN, fx_shl_q31(-1, UINT32_MAX));
    TEST_ASSERT_EQUAL_INT32(0, fx_shl_q31(0, UINT32_MAX));
}

void test_constants_are_rounded_and_stop_at_the_ends_of_their_format(void)
{
    static const q15_t half = Q15(0.5); /* compiles only if the macro is a constant expression */
    TEST_ASSERT_EQUAL_INT16(16384, half);
    TEST_ASSERT_EQUAL_INT16(32767, Q15(1.0));
    TEST_ASSERT_EQUAL_INT16(-32768, Q15(-1.0));
    TEST_ASSERT_EQUAL_INT16(-32768, Q15(-7));
    TEST_ASSERT_EQUAL_INT16(32767, Q15(0.99999));
    TEST_ASSERT_EQUAL_INT16(-3277, Q15(-0.1)); /* -3276.8 */
    TEST_ASSERT_EQUAL_INT16(3277, Q15(0.1));
    TEST_ASSERT_EQUAL_INT16(1638, Q15(0.05)); /* 1638.4 */
    TEST_ASSERT_EQUAL_INT16(1, Q15(0.5 / 32768));
    TEST_ASSERT_EQUAL_INT16(0, Q15(0.49 / 32768));
    TEST_ASSERT_EQUAL_INT16(-1, Q15(-0.5 / 32768));
    TEST_ASSERT_EQUAL_INT16(0, Q15(-0.49 / 32768));
    TEST_ASSERT_EQUAL_INT32(INT32_MAX, Q31(1));
    TEST_ASSERT_EQUAL_INT32(INT32_MIN, Q31(-1));
    TEST_ASSERT_EQUAL_INT32(0x40000000, Q31(0.5));
    TEST_ASSERT_EQUAL_INT32(-214748365, Q31(-0.1)); /* -214748364.8 */
    TEST_ASSERT_EQUAL_INT32(Q16_ONE, Q16(1));
    TEST_ASSERT_EQUAL_INT32(-98304, Q16(-1.5));
    TEST_ASSERT_EQUAL_INT32(INT32_MAX, Q16(32768.0));
    TEST_ASSERT_EQUAL_INT32(INT32_MIN, Q16(-1e9));
}
