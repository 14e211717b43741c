/* SPDX-License-Identifier: Apache-2.0 */
#ifndef SIGNAL_RATE_LIMIT_H
#define SIGNAL_RATE_LIMIT_H
/** Slew limit: the output follows the target by at most rate per step.
 *   y[k] = y[k-1] + clamp(x - y[k-1], -rate, +rate); with rate = Q15_MAX there is no limit and y = x
 * Source   docs/theory/torque-loop.md (TL-10)
 * Units    those of the signal
 * Range    rate [0, Q15_MAX]; every x, y
 * Rounding none: exact
 * Errors   none
 * Context  any; no division, no loop */
#include "fx/q.h"

static inline q15_t rate_limit_step(q15_t last, q15_t target, q15_t rate)
{
    if (rate == Q15_MAX) {
        return target;
    }
    return fx_sat_q15(last + fx_clamp_q31(target - last, -rate, rate));
}

#endif
