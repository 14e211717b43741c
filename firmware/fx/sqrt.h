/* SPDX-License-Identifier: Apache-2.0 */
#ifndef FX_SQRT_H
#define FX_SQRT_H

/** Square roots: y = sqrt(x), x times an interpolated table of 1/sqrt; q31 adds one Newton step.
 * Source   docs/theory/fixed-point.md (FX-13) to (FX-17)
 * Units    per unit; the q30 argument is unsigned, [0, 4), as a sum of two squares comes
 * Range    every argument; negative q31 gives 0, q30 of 1 and more gives Q15_MAX
 * Rounding below 1 LSB of the result: 0.69 (q30), 0.87 (q31)
 * Errors   none
 * Context  any; 21 (q30) and 30 (q31) instructions as a call, no division, no loop */

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
    const unsigned shift = (unsigned)__builtin_clz(q30) & 30U;
    const uint32_t m = q30 << shift;
    /* Q31 * Q29 = Q28: sqrt(m) = m / sqrt(m) */
    const int32_t root = fx_mulhi((int32_t)(m >> 1), fx_rsqrt_normalised(m));
    return fx_sat_q15(((root >> (shift >> 1)) + 0x800) >> 12);
}

static inline q31_t fx_sqrt_q31(q31_t x)
{
    if (x <= 0) {
        return 0;
    }
    const unsigned shift = (unsigned)__builtin_clz((uint32_t)x << 1) & 30U;
    const uint32_t m = ((uint32_t)x << 1) << shift;
    const int32_t inverse = fx_rsqrt_normalised(m);
    const uint32_t root = (uint32_t)fx_mulhi((int32_t)(m >> 1), inverse) >> 6; /* Q22 */
    /* m - root^2 in Q44: it is small, so its low word is all of it. */
    const int32_t residual = (int32_t)((m << 12) - (root * root));
    const int32_t step = fx_mulhi(residual, inverse); /* Q44 * Q29 = Q41, halved: Q42 */
    const uint32_t fine = (root << 9) + (uint32_t)((step + 0x400) >> 11);
    const unsigned scale = shift >> 1;
    /* The Newton step errs downwards only, so even the root of Q31_MAX stays below 1. */
    return (int32_t)((fine + ((1U << scale) >> 1)) >> scale);
}

#endif
