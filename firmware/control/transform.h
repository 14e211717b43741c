/* SPDX-License-Identifier: Apache-2.0 */
#ifndef CONTROL_TRANSFORM_H
#define CONTROL_TRANSFORM_H
/** Changes of reference frame, amplitude-invariant.
 *   Clarke  alpha = (2a - b - c)/3, beta = (b - c)/sqrt(3)
 *   Park  d = alpha cos + beta sin, q = beta cos - alpha sin
 *   inverse Clarke  a = alpha, b,c = -alpha/2 +- sqrt(3)/2 beta
 * Source   docs/theory/current-control.md (CC-1)
 * Units    per unit
 * Range    any: the sum of two products stays below 2 less one rounding for every q15 vector and unit sine/cosine;
 *          inverse_park_q30: Q30 in the fields, not rounded
 * Rounding half up once per component, 1/2 LSB q15
 * Errors   saturates
 * Context  fast ISR; 5 to 8 instructions each, no division, no loop */
#include "fx/q.h"
#include "fx/trig.h"
#include "types/frames.h"

/* Q30 to Q15, half up. */
static inline int32_t transform_round(int32_t q30)
{
    return fx_sat_q15_word((q30 + 0x4000) >> 15);
}

static inline ab_t clarke(abc_t x)
{
    /* The coefficients sum to -1 LSB: a zero sequence of full scale leaks 1 LSB into alpha. */
    const int32_t alpha = x.a * Q15(2.0 / 3.0) + (x.b + x.c) * Q15(-1.0 / 3.0); /* below 4/3 in Q30 */
    const int32_t beta = (x.b - x.c) * Q15(0.57735026918962576);               /* |b - c| < 2 */
    return (ab_t){transform_round(alpha), transform_round(beta)};
}

static inline dq_t park(ab_t x, fx_sincos_t at)
{
    return (dq_t){transform_round(x.alpha * at.cos + x.beta * at.sin),
                  transform_round(x.beta * at.cos - x.alpha * at.sin)};
}

static inline ab_t inverse_park_q30(dq_t x, fx_sincos_t at)
{
    return (ab_t){x.d * at.cos - x.q * at.sin, x.d * at.sin + x.q * at.cos};
}

static inline ab_t inverse_park(dq_t x, fx_sincos_t at)
{
    const ab_t q30 = inverse_park_q30(x, at);
    return (ab_t){transform_round(q30.alpha), transform_round(q30.beta)};
}

static inline abc_t inverse_clarke(ab_t x)
{
    const int32_t half_alpha = x.alpha * -16384; /* Q15 * Q15 = Q30 */
    const int32_t beta = x.beta * Q15(0.86602540378443865);
    return (abc_t){x.alpha, transform_round(half_alpha + beta), transform_round(half_alpha - beta)};
}

#endif
