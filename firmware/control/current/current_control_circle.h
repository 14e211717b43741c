/* SPDX-License-Identifier: Apache-2.0 */
#ifndef CURRENT_CURRENT_CONTROL_CIRCLE_H
#define CURRENT_CURRENT_CONTROL_CIRCLE_H
/** The voltage circle of both laws of current control: its radius, and which axis gives way at it.
 *   v = u/v_max, v_max = v_ratio v_dc, is limited to the unit circle.
 *   psi_d* <= psi_d: the d axis has priority. v_q gets the rest of the circle, at least a quarter, and is reduced, with
 *     the sign of w, by what v_d exceeds the circle.
 *   psi_d* > psi_d: the q axis has priority and the d axis keeps 0.7 of the circle. Otherwise the q current could never
 *     fall, and its flux would keep the d axis at its limit.
 * Source   docs/theory/current-control.md (CC-11), (CC-14), (CC-15)
 * Units    per unit of v_max
 * Range    a v_dc below 1/(64 v_ratio) is replaced by that value; below 2 LSB the voltage is 0
 * Rounding the circle is a table of 256 steps that never exceeds it
 * Errors   saturates
 * Context  fast ISR, one bounded hardware division; included by current_control.c and current_control_turning.c only */
#include "fx/circle.h"
#include "fx/div.h"
#include "fx/q.h"
#include "types/frames.h"

#define V_D_MIN Q15(0.7) /* share of the circle that the d axis may always use (CC-11) */

/* 1/(v_ratio v_dc), Q25 (CC-15), at most 64. Q31/Q15 = Q16. */
static inline int32_t reciprocal_v_max(uint32_t per_ratio_q31, int32_t v_dc)
{
    return fx_usat_bits(fx_quotient(per_ratio_q31, (uint32_t)v_dc), 22) * 512;
}

/* Clamps to [-limit - 1, limit]. The magnitude is the ones' complement, so that one comparison is enough. */
static inline int32_t clamp_symmetric(int32_t x, int32_t limit)
{
    return fx_min_s32(x ^ (x >> 31), limit) ^ (x >> 31);
}

/* Largest voltage of one axis inside the unit circle, given the other axis' voltage; at least a quarter (CC-11). */
static inline int32_t remaining_voltage(int32_t other)
{
    return fx_circle_table[(other ^ (other >> 31)) >> 7];
}

/* While the d flux is to fall, the d axis has priority, and its excess is subtracted from q (CC-14). While the d flux
 * is to rise, the q axis has priority, because the q flux may be what limits the d axis; d keeps 0.7 of the circle, or
 * else the d flux would fall further and i_d would grow (CC-11). */
static inline dq_q15_t limit_to_circle(dq_q15_t v, int32_t error_d, int32_t omega)
{
    const dq_q15_t clipped = {fx_sat_q15_word(v.d), fx_sat_q15_word(v.q)};
    if (error_d > 0) {
        return (dq_q15_t){clamp_symmetric(clipped.d, fx_max_s32(remaining_voltage(clipped.q), V_D_MIN)), clipped.q};
    }
    const int32_t excess = fx_sat_q15_word(v.d - clipped.d);
    const int32_t sign = omega >> 31; /* two's complement: an excess of 0 must change nothing */
    const int32_t reduced_q = v.q + (excess ^ sign) - sign;
    return (dq_q15_t){clipped.d, clamp_symmetric(reduced_q, remaining_voltage(clipped.d))};
}

#endif
