/* SPDX-License-Identifier: Apache-2.0 */
#ifndef FX_DIV_H
#define FX_DIV_H

/** Division q = num / den in the named format, defined for every argument; none causes a trap.
 *   den = 0: the end of the format with the sign of num; 0 / 0 = 0. fx_quotient(): 0.
 * Source   docs/theory/fixed-point.md (FX-10) to (FX-12)
 * Units    per unit
 * Range    every argument; quotients outside the format saturate
 * Rounding to nearest, 1/2 LSB: no quotient lies halfway (FX-12); fx_quotient truncates
 * Errors   none: saturation is the defined result; fx_quotient wraps
 * Context  any; fx_quotient, fx_div_q15: one hardware division (2 to 12 cycles), 1 and 13 instructions;
 *          fx_div_q31: two, 72 */

#include "fx/q.h"

/* num / den of unsigned words, truncated; 0 for den = 0. A quotient of 2^31 and more comes back as a negative number
 * with the same bits. */
static inline int32_t fx_quotient(uint32_t num, uint32_t den)
{
    return fx_arch_udiv(num, den);
}

/* (num * 2^15) / den of two q15 numbers, which may come in words. */
q15_t fx_div_q15(int32_t num, int32_t den);

/* (num * 2^31) / den, rounded, by two 16-bit digits. */
q31_t fx_div_q31(int32_t num, int32_t den);

#endif
