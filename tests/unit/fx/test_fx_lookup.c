/* SPDX-License-Identifier: Apache-2.0 */
#include <math.h>

#include "fx/lookup.h"
#include "fx_vectors.h"
#include "unity.h"

#define NX 5
#define NY 4
#define MAX_POINTS 40

static int16_t table[MAX_POINTS];

void setUp(void)
{
    for (int i = 0; i < MAX_POINTS; i++) {
        table[i] = random_s16();
    }
}

void tearDown(void)
{
}

/* Position in cells, limited to the grid, and the point to its left. */
static long double place(int32_t x, int32_t x0, unsigned shift, int n, int *index, bool *outside)
{
    const long double cells = ((long double)x - x0) / (long double)(1U << shift);
    const long double inside = clip(cells, 0.0L, n - 1);
    *index = (int)fminl(floorl(inside), n - 2);
    *outside = (cells != inside);
    return inside - *index;
}

/* Bilinear interpolation as the text-book has it; and the error the header allows for this cell. */
static long double bilinear(const fx_lut2_t *lut, int32_t x, int32_t y, long double *allowed, bool *outside)
{
    int ix;
    int iy;
    bool outside_y;
    const long double u = place(x, lut->grid.x0, lut->grid.x_shift, lut->grid.nx, &ix, outside);
    const long double v = place(y, lut->grid.y0, lut->grid.y_shift, lut->grid.ny, &iy, &outside_y);
    const int16_t *z = &lut->z[(ix * lut->grid.ny) + iy];
    const long double z00 = z[0];
    const long double z01 = z[1];
    const long double z10 = z[lut->grid.ny];
    const long double z11 = z[lut->grid.ny + 1];
    *outside = *outside || outside_y;
    *allowed = 0.5L + (fabsl(z00 - z01 - z10 + z11) / 32768.0L);
    *allowed += (u == 1.0L) ? fmaxl(fabsl(z10 - z00), fabsl(z11 - z01)) / 16384.0L : 0.0L;
    *allowed += (v == 1.0L) ? fmaxl(fabsl(z01 - z00), fabsl(z11 - z10)) / 16384.0L : 0.0L;
    return ((1 - u) * (((1 - v) * z00) + (v * z01))) + (u * (((1 - v) * z10) + (v * z11)));
}

static void check2(const fx_lut2_t *lut, int32_t x, int32_t y)
{
    long double allowed;
    bool want_clamped;
    bool clamped;
    const long double want = bilinear(lut, x, y, &allowed, &want_clamped);
    const q15_t got = fx_lookup2(lut, x, y, &clamped);
    worst_t worst = {0};
    worst_note(&worst, got - want, x, y);
    worst_expect(&worst, "fx_lookup2", allowed);
    expect_equal("clamped", x, y, clamped, want_clamped);
}

void test_bilinear_look_up_agrees_with_long_double_inside_and_outside_any_grid(void)
{
    for (unsigned shift = 0U; shift <= 14U; shift++) {
        const uint8_t other = (uint8_t)(14U - shift);
        const fx_lut2_t lut = {table, {-3 * (1 << shift), 1 - (1 << other), (uint8_t)shift, other, NX, NY}};
        for (int32_t i = 0; i < 20000; i++) {
            const int32_t wide = (NX + 2) << shift;
            const int32_t x = lut.grid.x0 - (1 << shift) + (int32_t)(random_u32() % (uint32_t)wide);
            const int32_t y = lut.grid.y0 - (1 << other) + (int32_t)(random_u32() % ((NY + 2U) << other));
            check2(&lut, x, y);
        }
        for (int32_t i = 0; i < CORNERS; i++) {
            check2(&lut, corner[i], lut.grid.y0 + 1);
            check2(&lut, lut.grid.x0 + 1, corner[i]);
            check2(&lut, corner[i], corner[CORNERS - 1 - i]);
        }
    }
}

void test_an_origin_at_the_end_of_int32_neither_wraps_nor_unflags(void)
{
    const fx_lut2_t low = {table, {INT32_MIN, INT32_MAX - 100, 4, 5, NX, NY}};
    for (int32_t i = 0; i < CORNERS; i++) {
        check2(&low, corner[i], INT32_MAX);
        check2(&low, INT32_MIN + 17, corner[i]);
    }
}

void test_grid_points_give_their_own_value_and_no_flag(void)
{
    const fx_lut2_t lut = {table, {-32768, 0, 13, 11, NX, NY}};
    for (int32_t ix = 0; ix < NX; ix++) {
        for (int32_t iy = 0; iy < NY; iy++) {
            bool clamped = true;
            const int32_t want = table[(ix * NY) + iy];
            const int32_t got = fx_lookup2(&lut, lut.grid.x0 + (ix << 13), iy << 11, &clamped);
            TEST_ASSERT_FALSE(clamped);
            /* The last row and column lie 2^-14 of a step inside: steps here are up to 2^16. */
            TEST_ASSERT_INT32_WITHIN(((ix == NX - 1) || (iy == NY - 1)) ? 8 : 0, want, got);
        }
    }
}

void test_one_count_beyond_the_grid_is_flagged_on_every_side(void)
{
    const fx_lut2_t lut = {table, {-100, 50, 14, 14, NX, NY}};
    const int32_t right = lut.grid.x0 + ((NX - 1) << 14);
    const int32_t top = lut.grid.y0 + ((NY - 1) << 14);
    bool clamped = false;
    const int32_t left = lut.grid.x0;
    const int32_t bottom = lut.grid.y0;
    const int32_t point[6][3] = {{left, bottom, 0},   {right, top, 0},        {left - 1, top, 1},
                                 {right + 1, top, 1}, {right, bottom - 1, 1}, {left, top + 1, 1}};
    for (int i = 0; i < 6; i++) {
        (void)fx_lookup2(&lut, point[i][0], point[i][1], &clamped);
        TEST_ASSERT_EQUAL_INT32(point[i][2], clamped);
    }
}

/* Weights that did not sum to one would scale the value; and -32768 leaves no room for an excess. */
void test_a_constant_table_gives_its_constant_everywhere(void)
{
    static const int16_t value[3] = {INT16_MIN, INT16_MAX, 12345};
    for (int k = 0; k < 3; k++) {
        for (int i = 0; i < MAX_POINTS; i++) {
            table[i] = value[k];
        }
        const fx_lut2_t lut = {table, {0, 0, 14, 12, NX, NY}};
        for (int32_t i = 0; i < 300000; i++) {
            bool clamped;
            const int32_t x = (int32_t)(random_u32() & 0xFFFFU);
            const int32_t y = (int32_t)(random_u32() & 0x3FFFU);
            expect_equal("constant", x, y, fx_lookup2(&lut, x, y, &clamped), value[k]);
        }
    }
}

static int32_t half_word(fx_pair_t pair, unsigned place_of)
{
    return (int32_t)((pair >> place_of) & 0xFFFFU);
}

void test_the_four_weights_are_never_negative_and_sum_to_one(void)
{
    const fx_grid_t grid = {0, 0, 14, 14, 2, 2};
    for (int32_t i = 0; i < 1000000; i++) {
        const int32_t x = (i < 16384) ? i : (int32_t)(random_u32() & 0x3FFFU);
        const int32_t y = (i < 16384) ? 16383 - i : (int32_t)(random_u32() & 0x3FFFU);
        const fx_cell_t cell = fx_cell(&grid, x, y);
        const int32_t w[4] = {half_word(cell.w0, 0U), half_word(cell.w0, 16U), half_word(cell.w1, 0U),
                              half_word(cell.w1, 16U)};
        expect_equal("sum", x, y, w[0] + w[1] + w[2] + w[3], 16384);
        /* w11 is u v rounded half up to Q14. */
        const int32_t excess = (w[3] * 16384) - (x * y);
        expect_equal("product", x, y, (excess > -8192) && (excess <= 8192), 1);
        for (int k = 0; k < 4; k++) {
            expect_equal("weight", x, y, w[k] <= 16384, 1);
        }
    }
}

void test_one_cell_serves_several_tables_on_one_grid(void)
{
    const fx_grid_t grid = {-512, 0, 8, 7, NX, NY};
    const fx_lut2_t lut = {&table[7], grid}; /* an odd address: unaligned loads */
    for (int32_t i = 0; i < 100000; i++) {
        const int32_t x = (int32_t)(random_u32() % 2000U) - 700;
        const int32_t y = (int32_t)(random_u32() % 700U) - 100;
        const fx_cell_t cell = fx_cell(&grid, x, y);
        bool clamped;
        const int32_t want = fx_lookup2(&lut, x, y, &clamped);
        expect_equal("interp", x, y, fx_cell_interp(&table[7], NY, cell), want);
        expect_equal("clamped", x, y, cell.outside != 0U, clamped);
    }
}

static void check1(const fx_lut1_t *lut, int32_t x)
{
    int index;
    bool outside;
    bool clamped;
    const long double u = place(x, lut->x0, lut->shift, lut->n, &index, &outside);
    const long double step = lut->y[index + 1] - lut->y[index];
    const q15_t got = fx_lookup1(lut, x, &clamped);
    worst_t worst = {0};
    worst_note(&worst, got - (lut->y[index] + (u * step)), x, lut->shift);
    worst_expect(&worst, "fx_lookup1", 0.5L + ((u == 1.0L) ? fabsl(step) / 16384.0L : 0.0L));
    expect_equal("clamped", x, lut->shift, clamped, outside);
}

void test_linear_look_up_agrees_with_long_double_inside_and_outside_any_grid(void)
{
    for (unsigned shift = 0U; shift <= 14U; shift++) {
        const uint8_t n = (uint8_t)((shift < 12U) ? MAX_POINTS : 7U);
        const fx_lut1_t lut = {table, -5 * (1 << shift), (uint8_t)shift, n};
        const fx_lut1_t two = {&table[1], 100, (uint8_t)shift, 2};
        for (int32_t i = 0; i < 20000; i++) {
            const uint32_t wide = (n + 4U) << shift;
            check1(&lut, lut.x0 - (2 << shift) + (int32_t)(random_u32() % wide));
            check1(&two, (int32_t)(random_u32() % (3U << shift)));
        }
        for (int32_t i = 0; i < CORNERS; i++) {
            check1(&lut, corner[i]);
            check1(&two, corner[i]);
        }
    }
}

/* Between 0 and +-1, one count of Q14 around the middle: where rounding turns over. */
void test_interpolated_values_round_half_up(void)
{
    static const int16_t up[4] = {0, 1, 0, 1};
    static const int16_t down[4] = {0, -1, 0, -1};
    static const int32_t want[3][2] = {{0, 0}, {1, 0}, {1, -1}};
    const fx_grid_t grid = {0, 0, 14, 14, 2, 2};
    const fx_lut1_t rising = {up, 0, 14, 2};
    const fx_lut1_t falling = {down, 0, 14, 2};
    for (int32_t i = 0; i < 3; i++) {
        bool clamped;
        const int32_t middle = 8191 + i;
        const fx_cell_t cell = fx_cell(&grid, 0, middle);
        TEST_ASSERT_EQUAL_INT32(want[i][0], fx_cell_interp(up, 2, cell));
        TEST_ASSERT_EQUAL_INT32(want[i][1], fx_cell_interp(down, 2, cell));
        TEST_ASSERT_EQUAL_INT32(want[i][0], fx_lookup1(&rising, middle, &clamped));
        TEST_ASSERT_EQUAL_INT32(want[i][1], fx_lookup1(&falling, middle, &clamped));
    }
}

void test_an_axis_is_valid_only_inside_the_documented_limits(void)
{
    TEST_ASSERT_TRUE(fx_axis_valid(0U, 2U));
    TEST_ASSERT_TRUE(fx_axis_valid(9U, 255U));
    TEST_ASSERT_TRUE(fx_axis_valid(14U, 8U));
    TEST_ASSERT_FALSE(fx_axis_valid(14U, 9U)); /* 2^17 wide */
    TEST_ASSERT_FALSE(fx_axis_valid(15U, 2U));
    TEST_ASSERT_FALSE(fx_axis_valid(UINT32_MAX, 2U));
    TEST_ASSERT_FALSE(fx_axis_valid(3U, 1U));
    TEST_ASSERT_FALSE(fx_axis_valid(3U, 0U));
    TEST_ASSERT_FALSE(fx_axis_valid(3U, 256U));
}
