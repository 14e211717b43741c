/* SPDX-License-Identifier: Apache-2.0 */
#include <math.h>

#include "fx/lookup.h"
#include "fx_vectors.h"
#include "unity.h"

#define NX 5
#define NY 4
#define MAX_POINTS 40

/* A table and its grid, row-major: z[ix * ny + iy]. */
typedef struct {
    const int16_t *z;
    fx_grid_t grid;
} table2_t;

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

/* Bilinear interpolation by its textbook formula, and the error that the header allows in this cell. */
static long double bilinear(const table2_t *lut, int32_t x, int32_t y, long double *allowed, bool *outside)
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

static int32_t lookup2(const table2_t *lut, int32_t x, int32_t y, bool *clamped)
{
    const fx_cell_t cell = fx_cell(&lut->grid, x, y);
    *clamped = cell.outside != 0U;
    return fx_cell_interp(lut->z, lut->grid.ny, cell);
}

static void check2(const table2_t *lut, int32_t x, int32_t y)
{
    long double allowed;
    bool want_clamped;
    bool clamped;
    const long double want = bilinear(lut, x, y, &allowed, &want_clamped);
    const int32_t got = lookup2(lut, x, y, &clamped);
    worst_t worst = {0};
    worst_note(&worst, got - want, x, y);
    worst_expect(&worst, "fx_cell_interp", allowed);
    expect_equal("clamped", x, y, clamped, want_clamped);
}

void test_bilinear_look_up_agrees_with_long_double_inside_and_outside_any_grid(void)
{
    for (unsigned shift = 0U; shift <= 14U; shift++) {
        const uint8_t other = (uint8_t)(14U - shift);
        const table2_t lut = {table, {-3 * (1 << shift), 1 - (1 << other), (uint8_t)shift, other, NX, NY}};
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

void test_an_origin_at_the_end_of_int32_neither_wraps_nor_hides_the_flag(void)
{
    const table2_t low = {table, {INT32_MIN, INT32_MAX - 100, 4, 5, NX, NY}};
    for (int32_t i = 0; i < CORNERS; i++) {
        check2(&low, corner[i], INT32_MAX);
        check2(&low, INT32_MIN + 17, corner[i]);
    }
}

void test_grid_points_give_their_own_value_and_no_flag(void)
{
    const table2_t lut = {table, {-32768, 0, 13, 11, NX, NY}};
    for (int32_t ix = 0; ix < NX; ix++) {
        for (int32_t iy = 0; iy < NY; iy++) {
            bool clamped = true;
            const int32_t want = table[(ix * NY) + iy];
            const int32_t got = lookup2(&lut, lut.grid.x0 + (ix << 13), iy << 11, &clamped);
            TEST_ASSERT_FALSE(clamped);
            /* On the last row and column the result is that of 2^-14 of a step before; steps here are up to 2^16. */
            TEST_ASSERT_INT32_WITHIN(((ix == NX - 1) || (iy == NY - 1)) ? 8 : 0, want, got);
        }
    }
}

void test_one_count_beyond_the_grid_is_flagged_on_every_side(void)
{
    const table2_t lut = {table, {-100, 50, 14, 14, NX, NY}};
    const int32_t right = lut.grid.x0 + ((NX - 1) << 14);
    const int32_t top = lut.grid.y0 + ((NY - 1) << 14);
    bool clamped = false;
    const int32_t left = lut.grid.x0;
    const int32_t bottom = lut.grid.y0;
    const int32_t point[6][3] = {{left, bottom, 0},   {right, top, 0},        {left - 1, top, 1},
                                 {right + 1, top, 1}, {right, bottom - 1, 1}, {left, top + 1, 1}};
    for (int i = 0; i < 6; i++) {
        (void)lookup2(&lut, point[i][0], point[i][1], &clamped);
        TEST_ASSERT_EQUAL_INT32(point[i][2], clamped);
    }
}

/* Weights whose sum is not one would scale the value; at -32768 any excess would overflow. */
void test_a_constant_table_gives_its_constant_everywhere(void)
{
    static const int16_t value[3] = {INT16_MIN, INT16_MAX, 12345};
    for (int k = 0; k < 3; k++) {
        for (int i = 0; i < MAX_POINTS; i++) {
            table[i] = value[k];
        }
        const table2_t lut = {table, {0, 0, 14, 12, NX, NY}};
        for (int32_t i = 0; i < 300000; i++) {
            bool clamped;
            const int32_t x = (int32_t)(random_u32() & 0xFFFFU);
            const int32_t y = (int32_t)(random_u32() & 0x3FFFU);
            expect_equal("constant", x, y, lookup2(&lut, x, y, &clamped), value[k]);
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
    for (int32_t i = 0; i < 100000; i++) {
        const int32_t x = (int32_t)(random_u32() % 2000U) - 700;
        const int32_t y = (int32_t)(random_u32() % 700U) - 100;
        const fx_cell_t cell = fx_cell(&grid, x, y);
        for (int k = 0; k < 4; k++) {
            const table2_t lut = {&table[7 + k],
                                  grid}; /* also at addresses that are not a multiple of four: unaligned loads */
            long double allowed;
            bool outside;
            const long double want = bilinear(&lut, x, y, &allowed, &outside);
            worst_t worst = {0};
            worst_note(&worst, fx_cell_interp(lut.z, NY, cell) - want, x, y);
            worst_expect(&worst, "fx_cell_interp", allowed);
            expect_equal("clamped", x, y, cell.outside != 0U, outside);
        }
    }
}

/* A position in cells, Q14, as (FX-22) and (FX-23) define it, in integers of 64 bits. */
static int64_t position_q14(int64_t distance, unsigned shift, int n)
{
    const int64_t last = ((int64_t)(n - 1) << 14) - 1;
    const int64_t cells = (distance < 0) ? 0 : distance * (INT64_C(1) << (14U - shift));
    return (cells > last) ? last : cells;
}

/* The weights and the index of (FX-24), by their definition: w11 = floor(u v / 2^14 + 1/2). */
typedef struct {
    int64_t index, column, w00, w01, w10, w11;
} exact_cell_t;

static exact_cell_t exact_cell(int64_t x, int64_t y, int ny)
{
    const int64_t u = x % 16384;
    const int64_t v = y % 16384;
    const int64_t w11 = (2 * u * v + 16384) / 32768;
    return (exact_cell_t){((x / 16384) * ny) + (y / 16384), y / 16384, 16384 - u - v + w11, v - w11, u - w11, w11};
}

static void check_mesh(const fx_mesh_t *mesh, unsigned shift, int nx, int ny, int32_t x, int32_t y)
{
    const int64_t right = (int64_t)x - mesh->x0;
    const exact_cell_t want = exact_cell(position_q14(right, shift, nx), position_q14(y, shift, ny), ny);
    const fx_cell_t got = fx_mesh_cell(mesh, x, (uint32_t)y);
    expect_equal("fx_mesh_cell, index", x, y, got.index, want.index);
    expect_equal("fx_mesh_cell, column", x, y, got.column, want.column);
    expect_equal("fx_mesh_cell, w0", x, y, got.w0, want.w00 + (want.w01 * 65536));
    expect_equal("fx_mesh_cell, w1", x, y, got.w1, want.w10 + (want.w11 * 65536));
    const int64_t v = want.w01 + want.w11;
    expect_equal("fx_mesh_cell, wy", x, y, got.wy, 16384 - v + (v * 65536));
    const bool outside = right < 0 || right > (int64_t)(nx - 1) << shift || y > (int64_t)(ny - 1) << shift;
    expect_equal("fx_mesh_outside", x, y, fx_mesh_outside(mesh, x, (uint32_t)y), outside);

    const int16_t *z = &table[want.index];
    const int64_t sum = (want.w00 * z[0]) + (want.w01 * z[1]) + (want.w10 * z[ny]) + (want.w11 * z[ny + 1]);
    expect_equal("fx_cell_sum", x, y, fx_cell_sum(table, mesh->ny, got), sum);
    expect_equal("fx_cell_interp", x, y, fx_cell_interp(table, mesh->ny, got),
                 (int64_t)floorl((sum / 16384.0L) + 0.5L));
    const int16_t *c = &table[want.column];
    const int64_t along_y = ((16384 - v) * c[0]) + (v * c[1]);
    expect_equal("fx_cell_interp_y", x, y, fx_cell_interp_y(table, got), (int64_t)floorl((along_y / 16384.0L) + 0.5L));
}

/* Every q15 x and every |y|, the magnitude of -1 included, on grids inside, at the ends of and beyond q15. */
static void check_whole_range(int32_t x0, unsigned shift, int nx, int ny)
{
    const fx_mesh_t mesh = FX_MESH(x0, shift, (uint32_t)nx, (uint32_t)ny);
    TEST_ASSERT_TRUE(fx_mesh_valid(&mesh));
    const int32_t x_end = x0 + ((nx - 1) << shift);
    const int32_t y_end = (ny - 1) << shift;
    for (int32_t x = -32768; x <= 32767; x++) {
        check_mesh(&mesh, shift, nx, ny, x, (int32_t)(random_u32() % 32769U));
        check_mesh(&mesh, shift, nx, ny, x, 32768);
    }
    for (int32_t y = 0; y <= 32768; y++) {
        check_mesh(&mesh, shift, nx, ny, random_s16(), y);
    }
    for (int32_t i = -2; i <= 2; i++) {
        for (int32_t j = -2; j <= 2; j++) {
            const int32_t y = (y_end + j < 0) ? 0 : y_end + j;
            check_mesh(&mesh, shift, nx, ny, (int32_t)clip(x0 + i, -32768.0L, 32767.0L), y);
            check_mesh(&mesh, shift, nx, ny, (int32_t)clip(x_end + i, -32768.0L, 32767.0L), y);
            check_mesh(&mesh, shift, nx, ny, (int32_t)clip(x_end + i, -32768.0L, 32767.0L), (j < 0) ? 0 : j);
        }
    }
}

void test_a_mesh_gives_the_exact_cell_and_sums_for_every_current_of_q15(void)
{
    check_whole_range(-32768, 13U, 9, 4); /* the whole of q15; |y| up to 3/4 */
    check_whole_range(-20000, 11U, 8, 5); /* ends inside the range on every side */
    check_whole_range(-3, 0U, 6, 6);      /* one count per cell */
    check_whole_range(0, 14U, 2, 3);      /* the widest cells */
    check_whole_range(32767, 14U, 3, 2);  /* begins at the largest x */
}

/* The ends of the weights and of the values: the accumulators' largest magnitudes. */
void test_the_sums_over_a_cell_of_extreme_values_are_exact(void)
{
    for (int pattern = 0; pattern < 16; pattern++) {
        for (int i = 0; i < MAX_POINTS; i++) {
            const int corner_of_cell = ((i / NY) % 2 * 2) + (i % NY % 2);
            table[i] = ((pattern >> corner_of_cell) & 1) ? INT16_MAX : INT16_MIN;
        }
        const fx_mesh_t mesh = FX_MESH(-16384, 13U, NX, NY);
        for (int32_t x = -16500; x <= 16500; x += 29) {
            for (int32_t y = 0; y <= 24700; y += 331) {
                check_mesh(&mesh, 13U, NX, NY, x, y);
            }
        }
    }
}

void test_a_mesh_is_valid_only_inside_the_documented_limits(void)
{
    const fx_mesh_t good = FX_MESH(-32768, 12U, 5U, 4U);
    TEST_ASSERT_TRUE(fx_mesh_valid(&good));
    fx_mesh_t bad = good;
    bad.up = 15U;
    TEST_ASSERT_FALSE(fx_mesh_valid(&bad));
    bad = good;
    bad.x_last += 1U;
    TEST_ASSERT_FALSE(fx_mesh_valid(&bad));
    bad = good;
    bad.y_last -= 1U;
    TEST_ASSERT_FALSE(fx_mesh_valid(&bad));
    bad = (fx_mesh_t)FX_MESH(0, 14U, 9U, 4U); /* 2^17 wide */
    TEST_ASSERT_FALSE(fx_mesh_valid(&bad));
    bad = (fx_mesh_t)FX_MESH(0, 14U, 4U, 9U);
    TEST_ASSERT_FALSE(fx_mesh_valid(&bad));
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

/* Between 0 and +-1, one count of Q14 around the middle, where the rounded value changes. */
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
