/* SPDX-License-Identifier: Apache-2.0 */
#ifndef FX_LOOKUP_H
#define FX_LOOKUP_H

/** Linear and bilinear look-up on a uniform grid whose spacing is a power of two.
 *   z = sum of w_k z_k over the cell's corners, weights Q14, non-negative, summing to exactly one.
 *   For several tables on one grid find the cell once, fx_cell(), then fx_cell_interp() per table.
 * Source   docs/theory/fixed-point.md (FX-27) to (FX-31)
 * Units    x, y: integers, any unit; grid point i is at x0 + i * 2^shift. Values: 16-bit, any scale
 * Range    2 <= n <= 255, shift <= 14, (n - 1) * 2^shift < 2^17, any x0; see fx_axis_valid().
 *          Any x: outside the grid, the edge's value and a flag
 * Rounding half up, 1/2 LSB, plus 2^-15 of the cell's twist |z00 - z01 - z10 + z11|; on the
 *          last grid point 2^-14 of the step across the cell before it
 * Errors   outside the grid: *clamped (or .clamped) is true, else false
 * Context  any; fx_cell about 44 instructions, each fx_cell_interp 6, all branch-free */

#include <stdbool.h>
#include <string.h>

#include "fx/q.h"

typedef struct {
    const int16_t *y;
    int32_t x0;
    uint8_t shift;
    uint8_t n;
} fx_lut1_t;

typedef struct {
    const int16_t *z; /* row-major: z[ix * ny + iy] */
    int32_t x0;
    int32_t y0;
    uint8_t x_shift;
    uint8_t y_shift;
    uint8_t nx;
    uint8_t ny;
} fx_lut2_t;

typedef struct {
    int32_t x0;
    int32_t y0;
    uint8_t x_shift;
    uint8_t y_shift;
    uint8_t nx;
    uint8_t ny;
} fx_grid_t;

typedef struct {
    uint32_t index; /* of the corner z00 */
    fx_pair_t w0;   /* weights of z00 and z01 = z[index + 1] */
    fx_pair_t w1;   /* weights of z10 = z[index + ny] and z11 */
    bool clamped;
} fx_cell_t;

typedef struct {
    uint32_t position; /* in cells, Q14, below n - 1 */
    uint32_t outside;  /* zero inside the grid */
} fx_axis_t;

static inline bool fx_axis_valid(unsigned shift, uint32_t n)
{
    return (n >= 2U) && (n <= 255U) && (shift <= 14U) && (((n - 1U) << shift) < 0x20000U);
}

static inline fx_axis_t fx_axis(int32_t x, int32_t x0, unsigned shift, uint32_t n)
{
    const int32_t offset = fx_sub_q31(x, x0);
    const uint32_t cells = (fx_arch_usat17(offset) << 14) >> shift;
    /* One count short of the last point, so that a cell always has a right-hand neighbour. */
    const uint32_t last = (n << 14) - 0x4001U;
    const uint32_t position = (cells > last) ? last : cells;
    /* The last point itself, one count above, is inside. */
    return (fx_axis_t){position, ((uint32_t)offset >> 31) | ((cells - position) >> 1)};
}

/* (1 - w, w) in Q14 for both halves at once; nothing carries between them. */
static inline fx_pair_t fx_weights(uint32_t weight)
{
    return 0x4000U + (weight << 16) - weight;
}

/* Two neighbours by one load; a 32-bit load may be unaligned on the processors meant. */
static inline fx_pair_t fx_load_pair(const int16_t *z)
{
    fx_pair_t pair;
    memcpy(&pair, z, sizeof pair);
    return pair;
}

static inline q15_t fx_lookup1(const fx_lut1_t *lut, int32_t x, bool *clamped)
{
    const fx_axis_t a = fx_axis(x, lut->x0, lut->shift, lut->n);
    const fx_pair_t weights = fx_weights(a.position & 0x3FFFU);
    *clamped = a.outside != 0U;
    return (q15_t)(fx_dot2_acc(0x2000, fx_load_pair(&lut->y[a.position >> 14]), weights) >> 14);
}

static inline fx_cell_t fx_cell(const fx_grid_t *grid, int32_t x, int32_t y)
{
    const fx_axis_t ax = fx_axis(x, grid->x0, grid->x_shift, grid->nx);
    const fx_axis_t ay = fx_axis(y, grid->y0, grid->y_shift, grid->ny);
    const uint32_t wx = ax.position & 0x3FFFU;
    const uint32_t wy = ay.position & 0x3FFFU;
    /* One product, the other three by subtraction: the four always sum to 2^14 (FX-29). */
    const uint32_t w11 = ((wx * wy) + 0x2000U) >> 14;
    const fx_pair_t w1 = wx + (w11 << 16) - w11; /* (wx - w11, w11) */
    return (fx_cell_t){((ax.position >> 14) * grid->ny) + (ay.position >> 14),
                       fx_weights(wy) - w1, w1, (ax.outside | ay.outside) != 0U};
}

static inline int32_t fx_cell_interp(const int16_t *z, uint32_t ny, fx_cell_t cell)
{
    const int16_t *corner = &z[cell.index];
    const int32_t acc = fx_dot2_acc(0x2000, fx_load_pair(corner), cell.w0);
    return fx_dot2_acc(acc, fx_load_pair(&corner[ny]), cell.w1) >> 14;
}

static inline q15_t fx_lookup2(const fx_lut2_t *lut, int32_t x, int32_t y, bool *clamped)
{
    const fx_grid_t grid = {lut->x0, lut->y0, lut->x_shift, lut->y_shift, lut->nx, lut->ny};
    const fx_cell_t cell = fx_cell(&grid, x, y);
    *clamped = cell.clamped;
    return (q15_t)fx_cell_interp(lut->z, lut->ny, cell);
}

#endif
