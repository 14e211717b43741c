/* SPDX-License-Identifier: Apache-2.0 */
#ifndef FX_LOOKUP_H
#define FX_LOOKUP_H

/** Linear and bilinear look-up on a uniform grid whose spacing is a power of two.
 *   z = sum of w_k z_k over the cell's corners, weights Q14, non-negative, summing to exactly one.
 *   For several tables on one grid: fx_cell() once, then fx_cell_interp() for each table.
 * Source   docs/theory/fixed-point.md (FX-22) to (FX-26)
 * Units    x, y: integers, any unit; grid point i is at x0 + i * 2^shift. Values: 16-bit, any scale
 * Range    2 <= n <= 255, shift <= 14, (n - 1) * 2^shift < 2^17, any x0; see fx_axis_valid().
 *          Any x: outside the grid, the edge's value and a flag
 * Rounding half up, 1/2 LSB, plus 2^-15 of the cell's twist |z00 - z01 - z10 + z11|; on the
 *          last grid point 2^-14 of the step across the cell before it
 * Errors   outside the grid: *clamped is true (.outside not zero, fx_mesh_outside()), else false
 * Context  any; fx_cell about 66 instructions, each fx_cell_interp 7, all branch-free */

#include <stdbool.h>
#include <string.h>

#include "fx/codegen.h"
#include "fx/q.h"

typedef struct {
    const int16_t *y;
    int32_t x0;
    uint8_t shift;
    uint8_t n;
} fx_lut1_t;

typedef struct {
    int32_t x0;
    int32_t y0;
    uint8_t x_shift;
    uint8_t y_shift;
    uint8_t nx;
    uint8_t ny;
} fx_grid_t;

/* A grid with the same spacing in x and y, y from 0, in the form that the look-up of every period uses. */
typedef struct {
    int32_t x0;
    uint32_t up;             /* 14 - shift */
    uint32_t x_last, y_last; /* in cells, Q14: one count short of the last point */
    uint32_t ny;
} fx_mesh_t;

#define FX_MESH(from, shift, n_x, n_y) \
    {(from), 14U - (shift), ((n_x) << 14) - 0x4001U, ((n_y) << 14) - 0x4001U, (n_y)}

typedef struct {
    uint32_t index;   /* of the corner z00 */
    uint32_t column;  /* of that corner: for tables that depend on y alone */
    fx_pair_t w0;     /* weights of z00 and z01 = z[index + 1] */
    fx_pair_t w1;     /* weights of z10 = z[index + ny] and z11 */
    fx_pair_t wy;     /* w0 + w1: of z[column] and z[column + 1] */
    uint32_t outside; /* not zero: the edge was used */
} fx_cell_t;

typedef struct {
    uint32_t position; /* in cells, Q14, below n - 1 */
    uint32_t outside;  /* zero inside the grid */
} fx_axis_t;

bool fx_axis_valid(unsigned shift, uint32_t n);

/* Position of a distance to the first grid point, limited to the grid. Not inlined, like fx_axis_valid(): no settled
 * period uses it. */
uint32_t fx_axis_position(int32_t offset, unsigned shift, uint32_t n);

static inline fx_axis_t fx_axis(int32_t x, int32_t x0, unsigned shift, uint32_t n)
{
    const int32_t offset = fx_sub_q31(x, x0);
    /* A negative offset is a very large number. The last point itself is inside. */
    return (fx_axis_t){fx_axis_position(offset, shift, n), (uint32_t)offset > (n - 1U) << shift};
}

/* (1 - w, w) in Q14, both halves of the word at once; no carry passes between them. */
static inline fx_pair_t fx_weights(uint32_t weight)
{
    return 0x4000U + (weight << 16) - weight;
}

/* Two neighbours by one 32-bit load, which every processor that is supported allows to be unaligned. */
static inline fx_pair_t fx_load_pair(const int16_t *z)
{
    fx_pair_t pair;
    (void)memcpy(&pair, z, sizeof pair);
    return pair;
}

static inline q15_t fx_lookup1(const fx_lut1_t *lut, int32_t x, bool *clamped)
{
    const fx_axis_t a = fx_axis(x, lut->x0, lut->shift, lut->n);
    const fx_pair_t weights = fx_weights(a.position & 0x3FFFU);
    *clamped = a.outside != 0U;
    return (q15_t)(fx_dot2_acc(0x2000, fx_load_pair(&lut->y[a.position >> 14]), weights) >> 14);
}

/* The cell of two positions in cells, Q14, each below its last. */
static inline fx_cell_t fx_cell_at(uint32_t x, uint32_t y, uint32_t ny)
{
    const uint32_t wx = x & 0x3FFFU;
    const uint32_t wy = y & 0x3FFFU;
    /* One product, the other three by subtraction: the four always sum to 2^14 (FX-24). */
    const uint32_t w11 = ((wx * wy) + 0x2000U) >> 14;
    const fx_pair_t w1 = wx + (w11 << 16) - w11; /* (wx - w11, w11) */
    const fx_pair_t w = fx_weights(wy);
    const uint32_t column = y >> 14;
    return (fx_cell_t){((x >> 14) * ny) + column, column, w - w1, w1, w, 0U};
}

static inline fx_cell_t fx_cell(const fx_grid_t *grid, int32_t x, int32_t y)
{
    const fx_axis_t ax = fx_axis(x, grid->x0, grid->x_shift, grid->nx);
    const fx_axis_t ay = fx_axis(y, grid->y0, grid->y_shift, grid->ny);
    fx_cell_t cell = fx_cell_at(ax.position, ay.position, grid->ny);
    cell.outside = ax.outside | ay.outside;
    return cell;
}

static inline bool fx_mesh_valid(const fx_mesh_t *mesh)
{
    const unsigned shift = 14U - mesh->up;
    return fx_axis_valid(shift, (mesh->x_last >> 14) + 2U) && (mesh->x_last & 0x3FFFU) == 0x3FFFU &&
           fx_axis_valid(shift, mesh->ny) && mesh->y_last == (mesh->ny << 14) - 0x4001U;
}

/* fx_cell() of a q15 x and |y|, without its flag; inside the grid nothing needs to be limited. */
static inline fx_cell_t fx_mesh_cell(const fx_mesh_t *mesh, int32_t x, uint32_t y)
{
    uint32_t px = (uint32_t)(x - mesh->x0) << mesh->up;
    uint32_t py = y << mesh->up;
    const uint32_t x_last = mesh->x_last;
    const uint32_t y_last = mesh->y_last;
    if (__builtin_expect(px > x_last, 0)) { /* x below the grid gives a very large number */
        px = (x < mesh->x0) ? 0U : x_last;
    }
    if (__builtin_expect(py > y_last, 0)) {
        py = (uint32_t)fx_in_register((int32_t)y_last); /* remains a branch: it costs less than two conditional ones */
    }
    return fx_cell_at(px, py, mesh->ny);
}

/* True where fx_cell() would report x or y as outside. The last point itself, one count above, is inside. */
static inline bool fx_mesh_outside(const fx_mesh_t *mesh, int32_t x, uint32_t y)
{
    return (uint32_t)(x - mesh->x0) << mesh->up > mesh->x_last + 1U || y << mesh->up > mesh->y_last + 1U;
}

/* The interpolated value before rounding: the table's format with 14 bits more. */
static inline int32_t fx_cell_sum(const int16_t *z, uint32_t ny, fx_cell_t cell)
{
    return fx_dot2_acc(fx_dot2(fx_load_pair(&z[cell.index]), cell.w0), fx_load_pair(&z[cell.index + ny]), cell.w1);
}

static inline int32_t fx_cell_interp(const int16_t *z, uint32_t ny, fx_cell_t cell)
{
    const int32_t acc = fx_dot2_acc(0x2000, fx_load_pair(&z[cell.index]), cell.w0);
    return fx_dot2_acc(acc, fx_load_pair(&z[cell.index + ny]), cell.w1) >> 14;
}

/* A table over y alone: the result of fx_cell_interp() for a table whose rows are all the same. */
static inline int32_t fx_cell_interp_y(const int16_t *z, fx_cell_t cell)
{
    return fx_dot2_acc(0x2000, fx_load_pair(&z[cell.column]), cell.wy) >> 14;
}

#endif
