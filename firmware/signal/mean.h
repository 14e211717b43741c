/* SPDX-License-Identifier: Apache-2.0 */
#ifndef SIGNAL_MEAN_H
#define SIGNAL_MEAN_H
/** First-order mean in a word.
 *   mean + (x - mean)/2^shift: a step of x is followed to 1 - 1/e in 2^shift steps
 * Source   docs/theory/monitors.md (MN-22), (MN-28)
 * Units    those of x
 * Range    |x - mean| < 2^31; shift 0 ... 30: with 0 the mean is x
 * Rounding down, so that the mean stays up to 2^shift - 1 below a constant x that it has risen to; the caller scales x
 * Errors   none
 * Context  any; no division, no loop */
#include <stdint.h>

static inline int32_t mean_step(int32_t mean, int32_t x, int shift)
{
    return mean + ((x - mean) >> shift);
}

#endif
