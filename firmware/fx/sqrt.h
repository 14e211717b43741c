/* SPDX-License-Identifier: Apache-2.0 */
#ifndef FX_SQRT_H
#define FX_SQRT_H

/** Square root: y = sqrt(x) = x times an interpolated table of 1/sqrt.
 * Source   docs/theory/fixed-point.md (FX-13) to (FX-15)
 * Units    per unit; the q30 argument is unsigned, [0, 4): the range of a sum of two squares. Result q15
 * Range    every argument; 1 and more gives Q15_MAX
 * Rounding 0.69 LSB of the result
 * Errors   none
 * Context  any; 21 instructions as a call, no division, no loop */

#include "fx/q.h"

typedef struct {
    int32_t base;  /* 1/sqrt(m) at the cell's start, Q29 */
    int32_t slope; /* its change over the cell, scaled by 2^8 */
} fx_rsqrt_cell_t;

extern const fx_rsqrt_cell_t fx_rsqrt_table[192];

/* 1/sqrt(m / 2^32), Q29, for a normalised m of [2^30, 2^32). */
static inline int32_t fx_rsqrt_normalised(uint32_t m)
{
    const fx_rsqrt_cell_t cell = fx_rsqrt_table[(m >> 24) - 64U];
    return fx_mulhi_add(cell.base, cell.slope, (int32_t)(m & 0xFFFFFFU));
}

static inline q15_t fx_sqrt_q30(uint32_t q30)
{
    if (q30 == 0U) {
        return 0;
    }
    const unsigned shift = fx_leading_zeros(q30) & 30U;
    const uint32_t m = q30 << shift;
    /* Q31 * Q29 = Q28: sqrt(m) = m / sqrt(m) */
    const int32_t root = fx_mulhi((int32_t)(m >> 1), fx_rsqrt_normalised(m));
    return fx_sat_q15(((root >> (shift >> 1)) + 0x800) >> 12);
}

#endif
