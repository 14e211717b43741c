/* SPDX-License-Identifier: Apache-2.0 */
#ifndef TORQUE_CURRENT_CIRCLE_H
#define TORQUE_CURRENT_CIRCLE_H
/** Reduces i_q of a current beyond the current circle: i_d keeps its share, because it holds the flux.
 *   i_q <- sqrt(i_max^2 - i_d^2) where |i| > i_max;  i_d <- -i_max where i_d < -i_max
 * Source   docs/theory/current-reference.md (CR-7)
 * Units    per unit, q15
 * Range    i_d every q15, i_q its magnitude; i_max > 0
 * Rounding 0.7 LSB
 * Errors   none
 * Context  1 kHz task; a square root where |i| > i_max */
#include "fx/q.h"
#include "fx/vec.h"
#include "types/frames.h"

static inline dq_q15_t current_circle_limit(dq_q15_t i, q15_t i_max)
{
    const int32_t i_q_squared_max = fx_mul_q30(i_max, i_max) - fx_mul_q30((q15_t)i.d, (q15_t)i.d);
    if (fx_mul_q30((q15_t)i.q, (q15_t)i.q) <= i_q_squared_max) {
        return i;
    }
    return (dq_q15_t){fx_max_s32(i.d, -i_max), fx_root((uint32_t)fx_max_s32(i_q_squared_max, 0))};
}

#endif
