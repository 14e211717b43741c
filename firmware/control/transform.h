/* SPDX-License-Identifier: Apache-2.0 */
#ifndef CONTROL_TRANSFORM_H
#define CONTROL_TRANSFORM_H
/** Changes of reference frame, amplitude-invariant.
 *   Clarke  alpha = (2a - b - c)/3, beta = (b - c)/sqrt(3)      Park  d = alpha cos + beta sin, q = beta cos - alpha sin
 *   inverse Clarke  a = alpha, b,c = -alpha/2 +- sqrt(3)/2 beta
 * Source   docs/theory/current-control.md (CC-1)
 * Units    per unit
 * Range    Clarke any; Park and its inverse: the sum of two products stays below 2 for every q15 vector and unit sine/cosine
 * Rounding half up once per component, 1/2 LSB q15
 * Errors   saturates
 * Context  fast ISR; 5 to 8 instructions each, no division, no loop */
#include "fx/q.h"
#include "fx/trig.h"
#include "types/frames.h"

static inline ab_t clarke(abc_t x)
{
    /* The coefficients sum to -1 LSB: a zero sequence of full scale leaks 1 LSB into alpha. */
    const int32_t alpha = fx_mac_q30(fx_mac_q30(fx_mul_q30(Q15(2.0 / 3.0), x.a), Q15(-1.0 / 3.0), x.b), Q15(-1.0 / 3.0), x.c);
    const int32_t beta = (x.b - x.c) * (int32_t)Q15(0.57735026918962576); /* Q15 * Q15 = Q30, |b - c| < 2 */
    return (ab_t){fx_round_q15(alpha), fx_round_q15(beta)};
}

static inline dq_t park(ab_t x, fx_sincos_t at)
{
    return (dq_t){fx_round_q15(fx_mac_q30(fx_mul_q30(x.alpha, at.cos), x.beta, at.sin)),
                  fx_round_q15(fx_mul_q30(x.beta, at.cos) - fx_mul_q30(x.alpha, at.sin))};
}

static inline ab_t inverse_park(dq_t x, fx_sincos_t at)
{
    return (ab_t){fx_round_q15(fx_mul_q30(x.d, at.cos) - fx_mul_q30(x.q, at.sin)),
                  fx_round_q15(fx_mac_q30(fx_mul_q30(x.d, at.sin), x.q, at.cos))};
}

static inline abc_t inverse_clarke(ab_t x)
{
    const int32_t half_alpha = x.alpha * -16384;                                 /* Q15 * Q15 = Q30 */
    const int32_t beta = fx_mul_q30(x.beta, Q15(0.86602540378443865));
    return (abc_t){x.alpha, fx_round_q15(half_alpha + beta), fx_round_q15(half_alpha - beta)};
}

#endif
