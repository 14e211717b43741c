/* SPDX-License-Identifier: Apache-2.0 */
#ifndef CONTROL_COMMISSION_FIT_H
#define CONTROL_COMMISSION_FIT_H
/** Resistance and the inverter's voltage error against current, from a few direct currents at standstill.
 *   r = slope of u over i in the upper half of the levels; y_k = u_k - r i_k
 *   v_k: 3/2 y_k = sum over the phases of |c_x| v(|c_x| i_k), c the phases' cosines, v straight lines between the knots
 *   then each knot is averaged with those at half and twice its current
 *   level = mean of v_k in the upper half; knee = twice the area that v leaves below the level
 * Source   docs/theory/commissioning.md (CM-1) ... (CM-7)
 * Units    per unit, Q30; knots in Q15
 * Range    i rising, below 1/2; |u| below 1/8
 * Rounding below 2^-20 in the curve, 2^-16 relative in r
 * Errors   false: the currents do not rise, or the slope is not positive; the result is then of no use
 * Context  1 kHz task, once; one division, 200 interpolations */
#include <stdbool.h>
#include <stdint.h>

#include "fx/q.h"

#define COMMISSION_LEVELS 10U

typedef struct {
    int32_t i[COMMISSION_LEVELS], u[COMMISSION_LEVELS]; /* half the difference of both polarities */
    q15_t cosine[3];                                    /* of the phases, magnitudes, the largest first */
} commission_data_t;

typedef struct {
    int32_t knot[COMMISSION_LEVELS]; /* current of the phase that carries most, Q30 */
    int32_t v[COMMISSION_LEVELS];
    int32_t r;                       /* Q30 */
    int32_t level;
} commission_curve_t;

bool commission_fit(const commission_data_t *data, commission_curve_t *curve);
/** Current at which a straight line and then a constant would leave the same area below the level; Q30. */
int32_t commission_knee(const commission_curve_t *curve);

#endif
