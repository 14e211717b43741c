/* SPDX-License-Identifier: Apache-2.0 */
#include <math.h>

#include "fx/sqrt.h"
#include "fx/vec.h"
#include "fx_vectors.h"
#include "unity.h"

void setUp(void)
{
}

void tearDown(void)
{
}

static void note_q30(worst_t *worst, int64_t x)
{
    if ((x >= 0) && (x <= UINT32_MAX)) {
        const long double exact = fminl(sqrtl((long double)x), 32767.0L);
        worst_note(worst, fx_sqrt_q30((uint32_t)x) - exact, x, 0);
    }
}

/* Around every perfect square and around the halfway points between them, where a result changes.
 * 1/2 LSB is the format's own rounding, 0.19 LSB the table's error of 1.2e-5 of the root. */
void test_the_root_of_a_sum_of_squares_is_within_its_bound_around_every_q15_result(void)
{
    worst_t worst = {0};
    for (int64_t r = 0; r <= 65535; r++) {
        for (int64_t offset = -2; offset <= 2; offset++) {
            note_q30(&worst, (r * r) + offset);
            note_q30(&worst, (r * r) + r + offset);
        }
    }
    worst_expect(&worst, "fx_sqrt_q30", 0.70L);
}

void test_the_root_of_a_sum_of_squares_is_within_its_bound_at_random_and_for_all_small_arguments(void)
{
    worst_t worst = {0};
    for (int64_t x = 0; x <= 300000; x++) {
        note_q30(&worst, x);
    }
    for (int32_t i = 0; i < 2000000; i++) {
        note_q30(&worst, random_u32() >> (random_u32() % 32U));
    }
    worst_expect(&worst, "fx_sqrt_q30", 0.70L);
}

void test_the_root_of_one_and_more_saturates(void)
{
    TEST_ASSERT_EQUAL_INT16(0, fx_sqrt_q30(0U));
    TEST_ASSERT_EQUAL_INT16(1, fx_sqrt_q30(1U));
    TEST_ASSERT_EQUAL_INT16(16384, fx_sqrt_q30(1U << 28)); /* sqrt(1/4) */
    TEST_ASSERT_EQUAL_INT16(32767, fx_sqrt_q30(1U << 30));
    TEST_ASSERT_EQUAL_INT16(32767, fx_sqrt_q30(UINT32_C(0x80000000)));
    TEST_ASSERT_EQUAL_INT16(32767, fx_sqrt_q30(UINT32_MAX));
}

static void note_magnitude(worst_t *worst, int32_t x, int32_t y)
{
    const long double exact = hypotl(x, y);
    worst_note(worst, fx_magnitude((q15_t)x, (q15_t)y) - fminl(exact, 32767.0L), x, y);
}

/* Along the unit circle the sum of squares crosses 2^30, where saturation begins. */
void test_vector_lengths_are_within_their_bound_on_both_sides_of_the_unit_circle(void)
{
    worst_t worst = {0};
    for (int32_t i = 0; i < 100000; i++) {
        const double angle = i * 6.283185307179586 / 100000.0;
        for (int32_t r = 32760; r <= 32768; r++) {
            const double x = fmin(r * cos(angle), 32767.0);
            const double y = fmin(r * sin(angle), 32767.0);
            note_magnitude(&worst, (int32_t)lrint(x), (int32_t)lrint(y));
        }
    }
    for (int32_t i = 0; i < 500000; i++) {
        note_magnitude(&worst, random_s16(), random_s16());
    }
    worst_expect(&worst, "fx_magnitude", 0.70L);
}

void test_the_corners_of_the_square_have_the_largest_length(void)
{
    TEST_ASSERT_EQUAL_INT16(32767, fx_magnitude(Q15_MIN, Q15_MIN));
    TEST_ASSERT_EQUAL_INT16(32767, fx_magnitude(Q15_MAX, Q15_MAX));
    TEST_ASSERT_EQUAL_INT16(32767, fx_magnitude(Q15_MIN, 0));
    TEST_ASSERT_EQUAL_INT16(32767, fx_magnitude(0, Q15_MAX));
    TEST_ASSERT_EQUAL_INT16(0, fx_magnitude(0, 0));
    TEST_ASSERT_EQUAL_INT16(25000, fx_magnitude(-15000, 20000)); /* 3-4-5 */
}

/* Pythagorean triples; the tolerance is the 0.7 LSB of the root. */
void test_the_root_of_a_difference_of_squares_is_the_leg_of_its_triangle(void)
{
    TEST_ASSERT_INT16_WITHIN(1, 4000, fx_root((5000 * 5000) - (3000 * 3000)));
    TEST_ASSERT_INT16_WITHIN(1, 5, fx_root((13 * 13) - (12 * 12)));
    TEST_ASSERT_EQUAL_INT16(0, fx_root(0));
    TEST_ASSERT_EQUAL_INT16(32767, fx_root(1U << 30));
    TEST_ASSERT_EQUAL_INT16(32767, fx_root(UINT32_MAX));
}
