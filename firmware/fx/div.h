/* SPDX-License-Identifier: Apache-2.0 */
#ifndef FX_DIV_H
#define FX_DIV_H

/** Guarded division: q = num / den in the named format. Every argument has a result, nothing traps.
 *   den = 0: the end of the format with the sign of num; 0 / 0 = 0. fx_reciprocal_q16(0) = maximum.
 * Source   docs/theory/fixed-point.md (FX-10) to (FX-12)
 * Units    per unit; fx_reciprocal_q16 takes q15 and returns a q16 gain
 * Range    every argument; quotients outside the format saturate
 * Rounding to nearest, 1/2 LSB: no quotient lies halfway (FX-12); fx_div_s32 truncates as C does
 * Errors   none: saturation is the defined result
 * Context  any; one hardware divide (2 to 12 cycles): 9 to 13 instructions; fx_div_q31: two, 72 */

#include "fx/q.h"

/* C's quotient; INT32_MIN / -1 saturates. */
static inline int32_t fx_div_s32(int32_t num, int32_t den)
{
    if (den == 0) {
        return (num == 0) ? 0 : ((num >> 31) ^ INT32_MAX);
    }
    return (den == -1) ? fx_neg_q31(num) : (num / den);
}

/* (num * 2^15) / den. */
q15_t fx_div_q15(q15_t num, q15_t den);

/* 2^31 / x: the value 2^15 / x carried to 16 fractional bits. */
static inline q16_t fx_reciprocal_q16(q15_t x)
{
    const uint32_t d = (uint32_t)((x < 0) ? -(int32_t)x : x);
    if (d <= 1U) {
        return (x < 0) ? INT32_MIN : INT32_MAX; /* 1 / 2^-15 is one above the largest gain */
    }
    const int32_t q = (int32_t)((UINT32_C(0x80000000) + (d >> 1)) / d);
    return (x < 0) ? -q : q;
}

/* (num * 2^31) / den, rounded, by two 16-bit digits. */
q31_t fx_div_q31(int32_t num, int32_t den);

#endif
