/* SPDX-License-Identifier: Apache-2.0 */
#ifndef CURRENT_TRANSFORM_H
#define CURRENT_TRANSFORM_H
/** Park transform, its inverse and the inverse of Clarke's, amplitude-invariant. The Clarke transform is part of
 * measure_step().
 *   Park  d = alpha cos + beta sin, q = beta cos - alpha sin;  inverse  alpha = d cos - q sin, beta = d sin + q cos
 *   Clarke, inverse  a = alpha, b = side - alpha/2, c = -side - alpha/2, with side = sqrt(3)/2 beta
 * Source   docs/theory/current-control.md (CC-1)
 * Units    per unit; the angle as its (cos, sin), fx_rotation()
 * Range    every q15 vector with a unit sine and cosine: the sum of two products stays below 2 in Q30
 * Rounding half up once per component, 1/2 LSB q15; inverse_park_q30 is exact; inverse_clarke rounds alpha/2 down
 * Errors   saturates
 * Context  fast ISR; 3 to 5 instructions each, no division, no loop */
#include "fx/q.h"
#include "fx/trig.h"
#include "types/frames.h"

/* Q30 to Q15, half up. */
static inline int32_t transform_round(int32_t q30)
{
    return fx_sat_q15_word((q30 + 0x4000) >> 15);
}

/* v: (alpha, beta) in one word. */
static inline dq_q15_t park_pair(fx_pair_t v, fx_pair_t at)
{
    return (dq_q15_t){fx_sat_q15_word(fx_dot2_acc(0x4000, at, v) >> 15),
                      fx_sat_q15_word(fx_difference2_cross_acc(0x4000, at, v) >> 15)};
}

static inline dq_q15_t park(ab_q15_t x, fx_pair_t at)
{
    return park_pair(fx_pair(x.alpha, x.beta), at);
}

static inline ab_q30_t inverse_park_q30(dq_q15_t x, fx_pair_t at)
{
    const fx_pair_t v = fx_pair(x.d, x.q);
    return (ab_q30_t){fx_difference2(v, at), fx_dot2_cross(v, at)};
}

/* In the scale of both arguments. Their caller multiplies by SQRT3_HALF, each with another factor of its own. */
static inline abc_t inverse_clarke(int32_t alpha, int32_t side)
{
    const int32_t b = side - (alpha >> 1);
    return (abc_t){alpha, b, b - 2 * side};
}

#endif
