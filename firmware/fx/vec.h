/* SPDX-License-Identifier: Apache-2.0 */
#ifndef FX_VEC_H
#define FX_VEC_H

/** Length of a vector: |v| = sqrt(x^2 + y^2).
 * Source   docs/theory/fixed-point.md (FX-26)
 * Units    per unit, q15
 * Range    every argument; lengths of 1 and more saturate to Q15_MAX
 * Rounding 0.69 LSB
 * Errors   none
 * Context  any; 23 instructions as a call */

#include "fx/sqrt.h"

static inline q15_t fx_magnitude(q15_t x, q15_t y)
{
    /* Each square is at most 2^30, so the sum, at most 2^31, fits the unsigned argument. */
    return fx_sqrt_q30((uint32_t)fx_mul_q30(x, x) + (uint32_t)fx_mul_q30(y, y));
}

#endif
