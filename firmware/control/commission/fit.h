/* SPDX-License-Identifier: Apache-2.0 */
#ifndef COMMISSION_FIT_H
#define COMMISSION_FIT_H
/** Resistance and the inverter's voltage error over current, from a few d-axis currents at standstill.
 *   r = slope of u over i in the upper half of the levels; y_k = u_k - r i_k
 *   v_k: 3/2 y_k = sum over the phases of |c_x| v(|c_x| i_k), c the phases' cosines, v linear between the knots;
 *     each knot is then averaged with those at half and twice its current
 *   level = mean of v_k in the upper half; knee = twice the area between the level and v
 * Source   docs/theory/commissioning.md (CM-1) ... (CM-7)
 * Units    per unit, Q30 unless the type says otherwise
 * Range    i rising, below 1/2; |u| below 1/8
 * Rounding below 2^-20 in the curve, 2^-16 relative in r
 * Errors   returns false if the currents do not rise or the slope is not positive; the result must not be used then
 * Context  1 kHz task, once; one division, 200 interpolations */
#include <stdbool.h>
#include <stdint.h>

#include "fx/q.h"

#define COMMISSION_LEVELS 10U

typedef struct {
    int32_t i[COMMISSION_LEVELS], u[COMMISSION_LEVELS]; /* half the difference of both polarities, Q30 */
    q15_t cosine[3];                                    /* of the phases, magnitudes, the largest first */
} commission_data_t;

typedef struct {
    int32_t knot[COMMISSION_LEVELS]; /* current of the phase with the largest current */
    int32_t v[COMMISSION_LEVELS];
    int32_t r;
    int32_t level;
} commission_curve_t;

bool commission_fit(const commission_data_t *data, commission_curve_t *curve);
/** Current at which a linear rise to the level, then constant, has the same area below the level. */
int32_t commission_knee(const commission_curve_t *curve);

#endif
