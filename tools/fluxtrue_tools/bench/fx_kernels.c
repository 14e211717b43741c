/* SPDX-License-Identifier: Apache-2.0 */
/* Every function of firmware/fx behind a call, for counting instructions and for comparing the two
 * sides of fx/arch.h. bench_<name> has the function's own argument types, so that the count holds
 * no conversion; batch_<name> runs it over n rows of three integers. */
#include "fx/codegen.h"
#include "fx/div.h"
#include "fx/lookup.h"
#include "fx/q.h"
#include "fx/sqrt.h"
#include "fx/trig.h"
#include "fx/vec.h"

typedef uint32_t u32;

#define BATCH(name, call) \
    void batch_##name(const int32_t (*row)[3], int64_t *out, u32 n); \
    void batch_##name(const int32_t (*row)[3], int64_t *out, u32 n) \
    { \
        for (u32 i = 0U; i < n; i++) { \
            out[i] = (int64_t)(call); \
        } \
    }
#define KERNEL1(name, R, A, result) \
    R bench_##name(A a); \
    __attribute__((noinline)) R bench_##name(A a) \
    { \
        return result; \
    } \
    BATCH(name, bench_##name((A)row[i][0]))
#define KERNEL2(name, R, A, B, result) \
    R bench_##name(A a, B b); \
    __attribute__((noinline)) R bench_##name(A a, B b) \
    { \
        return result; \
    } \
    BATCH(name, bench_##name((A)row[i][0], (B)row[i][1]))
#define KERNEL3(name, R, A, B, C, result) \
    R bench_##name(A a, B b, C c); \
    __attribute__((noinline)) R bench_##name(A a, B b, C c) \
    { \
        return result; \
    } \
    BATCH(name, bench_##name((A)row[i][0], (B)row[i][1], (C)row[i][2]))

/* What a call alone costs: subtracted from every count. */
KERNEL1(nothing, int32_t, int32_t, a)

KERNEL1(sat_q15, q15_t, int32_t, fx_sat_q15(a))
KERNEL1(sat_q15_word, int32_t, int32_t, fx_sat_q15_word(a))
KERNEL1(sat_bits_23, int32_t, int32_t, fx_sat_bits(a, 23))
KERNEL1(sat_bits_31, int32_t, int32_t, fx_sat_bits(a, 31))
KERNEL1(sat_bits_1, int32_t, int32_t, fx_sat_bits(a, 1))
KERNEL1(sat_bits_32, int32_t, int32_t, fx_sat_bits(a, 32))
KERNEL1(usat_bits_0, int32_t, int32_t, fx_usat_bits(a, 0))
KERNEL1(usat_bits_22, int32_t, int32_t, fx_usat_bits(a, 22))
KERNEL1(usat_bits_31, int32_t, int32_t, fx_usat_bits(a, 31))
KERNEL2(min_s32, int32_t, int32_t, int32_t, fx_min_s32(a, b))
KERNEL2(max_s32, int32_t, int32_t, int32_t, fx_max_s32(a, b))
KERNEL2(add2_q31, q31_t, q31_t, q31_t, fx_add2_q31(a, b))
KERNEL2(sat_q31, q31_t, int32_t, int32_t, fx_sat_q31((int64_t)a * 8 + (b & 7)))
KERNEL2(add_q15, q15_t, q15_t, q15_t, fx_add_q15(a, b))
KERNEL1(neg_q15, q15_t, q15_t, fx_neg_q15(a))
KERNEL1(abs_q15, q15_t, q15_t, fx_abs_q15(a))
KERNEL1(ones_magnitude, int32_t, int32_t, fx_ones_magnitude(a))
KERNEL2(add_q31, q31_t, q31_t, q31_t, fx_add_q31(a, b))
KERNEL2(sub_q31, q31_t, q31_t, q31_t, fx_sub_q31(a, b))
KERNEL2(add_wrap, int32_t, int32_t, int32_t, fx_add_wrap(a, b))
KERNEL2(sub_wrap, int32_t, int32_t, int32_t, fx_sub_wrap(a, b))
KERNEL1(in_register, int32_t, int32_t, fx_in_register(a))
/* Words stored and read again by one instruction, the first one distinguished from the second. */
static inline int64_t two_words(int32_t a, int32_t b)
{
    const struct {
        int32_t before, a, b;
    } at = {0, a, b};
    fx_two_words_t loaded = FX_LOAD_TWO(&at, a, b);
    fx_both_loaded(&loaded.first, &loaded.second);
    const volatile u32 registers[3] = {0U, (u32)a, (u32)b};
    const fx_two_words_t twice = fx_read_two(&registers[1]);
    const u32 same = (twice.first == loaded.first && twice.second == loaded.second) ? 0U : 1U;
    return (int64_t)(((uint64_t)(u32)loaded.first << 32) | (u32)loaded.second) ^ (int64_t)same;
}
KERNEL2(two_words, int64_t, int32_t, int32_t, two_words(a, b))
KERNEL2(load_two_words, int32_t, int32_t, int32_t, fx_load_two_words((const int32_t[2]){a, b}).second)
KERNEL1(neg_q31, q31_t, q31_t, fx_neg_q31(a))
KERNEL1(abs_q31, q31_t, q31_t, fx_abs_q31(a))
KERNEL1(round_q15, q15_t, int32_t, fx_round_q15(a))
KERNEL1(round_q15_word, int32_t, int32_t, fx_round_q15_word(a))
KERNEL1(q15_from_q31, q15_t, q31_t, fx_q15_from_q31(a))
KERNEL1(q31_from_q15, q31_t, q15_t, fx_q31_from_q15(a))
KERNEL2(mul_q15, q15_t, q15_t, q15_t, fx_mul_q15(a, b))
KERNEL2(mul_q30, int32_t, q15_t, q15_t, fx_mul_q30(a, b))
KERNEL3(mac_q30, int32_t, int32_t, q15_t, q15_t, fx_mac_q30(a, b, c))
KERNEL2(mulhi, int32_t, int32_t, int32_t, fx_mulhi(a, b))
KERNEL3(mulhi_add, int32_t, int32_t, int32_t, int32_t, fx_mulhi_add(a, b, c))
KERNEL3(mulhi_sub, int32_t, int32_t, int32_t, int32_t, fx_mulhi_sub(a, b, c))
KERNEL2(mul_q31, q31_t, q31_t, q31_t, fx_mul_q31(a, b))
KERNEL2(mul_q31_word, int32_t, q31_t, int32_t, fx_mul_q31_word(a, b))
KERNEL3(mac_q31_word, int32_t, int32_t, q31_t, int32_t, fx_mac_q31_word(a, b, c))
KERNEL2(mul_gain_q15, q15_t, q16_t, q15_t, fx_mul_gain_q15(a, b))
KERNEL2(mul_gain_q15_word, int32_t, q16_t, q15_t, fx_mul_gain_q15_word(a, b))
KERNEL2(mul_gain_q31, q31_t, q16_t, q31_t, fx_mul_gain_q31(a, b))
KERNEL2(shl_q31, q31_t, q31_t, u32, fx_shl_q31(a, b & 63U))
KERNEL2(shr_round, int32_t, int32_t, u32, fx_shr_round(a, b & 63U))
KERNEL1(shl_q31_by_3, q31_t, q31_t, fx_shl_q31(a, 3U))
KERNEL1(shr_round_by_3, int32_t, int32_t, fx_shr_round(a, 3U))
KERNEL3(clamp_q15, q15_t, q15_t, q15_t, q15_t, fx_clamp_q15(a, b, c))
KERNEL3(clamp_q31, q31_t, q31_t, q31_t, q31_t, fx_clamp_q31(a, b, c))
KERNEL2(pair, u32, q15_t, q15_t, fx_pair(a, b))
KERNEL2(pair_sub, u32, fx_pair_t, fx_pair_t, fx_pair_sub(a, b))
KERNEL2(dot2, int32_t, fx_pair_t, fx_pair_t, fx_dot2(a, b))
KERNEL3(dot2_acc, int32_t, int32_t, fx_pair_t, fx_pair_t, fx_dot2_acc(a, b, c))
KERNEL2(dot2_cross, int32_t, fx_pair_t, fx_pair_t, fx_dot2_cross(a, b))
KERNEL2(difference2, int32_t, fx_pair_t, fx_pair_t, fx_difference2(a, b))
KERNEL3(difference2_cross_acc, int32_t, int32_t, fx_pair_t, fx_pair_t, fx_difference2_cross_acc(a, b, c))
KERNEL1(usat_q15_word, int32_t, int32_t, fx_usat_q15_word(a))
KERNEL1(rotation, fx_pair_t, u32, fx_rotation(a))
KERNEL1(unit_vector, fx_pair_t, u32, fx_unit_vector(a))
KERNEL2(quotient, int32_t, u32, u32, fx_quotient(a, b))
KERNEL2(div_q15, q15_t, q15_t, q15_t, fx_div_q15(a, b))
KERNEL2(div_q31, q31_t, int32_t, int32_t, fx_div_q31(a, b))
KERNEL1(sqrt_q30, q15_t, u32, fx_sqrt_q30(a))
KERNEL2(magnitude, q15_t, q15_t, q15_t, fx_magnitude(a, b))
KERNEL2(leg, q15_t, q15_t, q15_t, fx_root((uint32_t)fx_max_s32(fx_mul_q30(a, a) - fx_mul_q30(b, b), 0)))
/* As an inlined caller has them: each in a register of its own (r0 and r1). */
static inline int64_t sincos_in_registers(uint16_t angle)
{
    const fx_sincos_t unit = fx_sincos(angle);
    const u32 low = (u32)unit.sin;
    const u32 high = (u32)unit.cos;
    return (int64_t)(((uint64_t)high << 32) | low);
}
KERNEL1(sincos, int64_t, uint16_t, sincos_in_registers(a))
/* As a called function returns them: packed into r0. */
fx_sincos_t bench_sincos_struct(uint16_t a);
__attribute__((noinline)) fx_sincos_t bench_sincos_struct(uint16_t a)
{
    return fx_sincos(a);
}

/* Any numbers do, as long as a wrong weight or a wrong corner shows. */
static const int16_t values[60] = {
    -32768, 32767,  -32768, 0,     12345, -23456, 32767, 1,    -1,    7777,  -8888, 9999,   100,    -200,  300,
    -400,   500,    -600,   700,   -800,  900,    -1000, 1100, -1200, 32767, 32767, -32768, -32768, 0,     0,
    16384,  -16384, 8192,   -8192, 4096,  -4096,  3,     -5,   17,    -257,  4097,  -65,    -30000, 30000, 2500,
    -2500,  111,    -222,   333,   -444,  555,    -666,  777,  -888,  999,   -1111, 2222,   -3333,  4444,  -5555,
};
static const fx_lut1_t line = {values, -32768, 11, 33};
static const fx_grid_t grid = {-32768, 0, 12, 13, 9, 5};

static inline int32_t lookup1(int32_t x)
{
    bool clamped;
    const int32_t z = fx_lookup1(&line, x, &clamped);
    return clamped ? ~z : z;
}

/* The grid by pointer, as configurations have it: nothing about it is known when compiling. */
static const fx_grid_t *volatile grid_pointer = &grid;

static inline int32_t one_table(const fx_grid_t *g, int32_t x, int32_t y)
{
    const fx_cell_t cell = fx_cell(g, x, y);
    const int32_t z = fx_cell_interp(values, g->ny, cell);
    return (cell.outside != 0U) ? ~z : z;
}

static inline int32_t five_tables(const fx_grid_t *g, int32_t x, int32_t y)
{
    const fx_cell_t cell = fx_cell(g, x, y);
    int32_t z = fx_cell_interp(values, g->ny, cell);
    z += fx_cell_interp(&values[1], g->ny, cell);
    z += fx_cell_interp(&values[2], g->ny, cell);
    z += fx_cell_interp(&values[3], g->ny, cell);
    z += fx_cell_interp(&values[4], g->ny, cell);
    return (cell.outside != 0U) ? ~z : z;
}

/* Inside q15, beyond its ends, and one count per cell; the arguments have the range that the mesh is for. */
static const fx_mesh_t mesh = FX_MESH(-20000, 12U, 9U, 5U);
static const fx_mesh_t finest = FX_MESH(-3, 0U, 6U, 6U);
static const fx_mesh_t *volatile mesh_pointer = &mesh;
static const fx_mesh_t *volatile finest_pointer = &finest;

static inline int64_t words(u32 high, u32 low)
{
    return (int64_t)(((uint64_t)high << 32) | low);
}

static inline fx_cell_t cell_of(const fx_mesh_t *m, int32_t x, int32_t y)
{
    return fx_mesh_cell(m, (int16_t)(x & 0xFFFF), (u32)y % 32769U);
}

static inline int64_t mesh_index(const fx_mesh_t *m, int32_t x, int32_t y)
{
    const fx_cell_t cell = cell_of(m, x, y);
    const bool outside = fx_mesh_outside(m, (int16_t)(x & 0xFFFF), (u32)y % 32769U);
    return words((outside ? 0x10000U : 0U) + cell.column, cell.index);
}

static inline int64_t mesh_weights(const fx_mesh_t *m, int32_t x, int32_t y)
{
    const fx_cell_t cell = cell_of(m, x, y);
    return words(cell.w0 ^ (cell.wy * 3U), cell.w1);
}

static inline bool mesh_valid(int32_t x, int32_t y)
{
    const fx_mesh_t m = {x, (u32)x & 15U, (u32)y, (u32)x, (u32)y & 255U};
    const fx_mesh_t made = FX_MESH(x, (u32)y & 15U, (u32)x & 255U, ((u32)y >> 8) & 255U);
    return fx_mesh_valid(&m) != fx_mesh_valid(&made);
}

KERNEL2(mesh_index, int64_t, int32_t, int32_t, mesh_index(mesh_pointer, a, b))
KERNEL2(mesh_weights, int64_t, int32_t, int32_t, mesh_weights(mesh_pointer, a, b))
KERNEL2(finest_mesh_index, int64_t, int32_t, int32_t, mesh_index(finest_pointer, a, b))
KERNEL2(finest_mesh_weights, int64_t, int32_t, int32_t, mesh_weights(finest_pointer, a, b))
KERNEL2(mesh_valid, bool, int32_t, int32_t, mesh_valid(a, b))
KERNEL2(cell_sum, int32_t, int32_t, int32_t, fx_cell_sum(values, 5U, cell_of(mesh_pointer, a, b)))
KERNEL2(cell_interp, int32_t, int32_t, int32_t, fx_cell_interp(values, 5U, cell_of(mesh_pointer, a, b)))
KERNEL2(cell_interp_y, int32_t, int32_t, int32_t, fx_cell_interp_y(&values[7], cell_of(mesh_pointer, a, b)))
KERNEL2(axis_valid, bool, u32, u32, fx_axis_valid(a, b))
KERNEL1(lookup1, int32_t, int32_t, lookup1(a))
KERNEL2(one_table, int32_t, int32_t, int32_t, one_table(grid_pointer, a, b))
KERNEL2(five_tables, int32_t, int32_t, int32_t, five_tables(grid_pointer, a, b))
