/* SPDX-License-Identifier: Apache-2.0 */
#ifndef SIGNAL_COUNTER_H
#define SIGNAL_COUNTER_H
/** Counters of events that stop at their largest value: a counter that wrapped to 0 would report too few events.
 *   count_up_to(count, max) = min(count + 1, max)
 * Source   docs/howto/can.md, diagnostics
 * Units    events
 * Range    any; a count above max is limited to it
 * Rounding none: exact
 * Errors   none
 * Context  any; no division, no loop */
#include <stdint.h>

static inline uint32_t count_up_to(uint32_t count, uint32_t max)
{
    return (count < max) ? count + 1U : max;
}

static inline void count_up(uint16_t *counter)
{
    *counter = (uint16_t)count_up_to(*counter, UINT16_MAX);
}

#endif
