/* SPDX-License-Identifier: Apache-2.0 */
#ifndef SIGNAL_MEAN_H
#define SIGNAL_MEAN_H
/** First-order means.
 *   mean_step()   in a word: mean + (x - mean)/2^shift, follows a step of x to 1 - 1/e in 2^shift calls
 *   mean_follow() from + rate (to - from)
 * Source   docs/theory/monitors.md (MN-22), (MN-28); (MN-1), (MN-27)
 * Units    those of x
 * Range    |x - mean| < 2^31; shift 0 ... 30: with 0 the mean is x. rate [0, Q15_MAX], with Q15_MAX: to; every to
 * Rounding down, so that the mean stays up to 2^shift - 1 below a constant x that it has risen to; the caller scales x.
 *          mean_follow(): nearest, so that it stays up to 1/(2 rate) LSB away
 * Errors   none
 * Context  any; no division, no loop */
#include <stdint.h>

#include "fx/q.h"

static inline int32_t mean_step(int32_t mean, int32_t x, int shift)
{
    return mean + ((x - mean) >> shift);
}

static inline q15_t mean_follow(q15_t from, int32_t to, q15_t rate)
{
    return (rate == Q15_MAX) ? fx_sat_q15(to) : fx_sat_q15(from + fx_mul_q15(rate, fx_sat_q15(to - from)));
}

#endif
