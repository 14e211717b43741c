/* SPDX-License-Identifier: Apache-2.0 */
#ifndef SIGNAL_DEBOUNCE_H
#define SIGNAL_DEBOUNCE_H
/** Confirms a condition that holds in enough consecutive samples.
 *   count = min(count + 1, samples) while the condition holds, 0 as soon as it does not; confirmed: count = samples
 * Source   docs/theory/monitors.md (MN-4), (MN-5)
 * Units    count: consecutive samples
 * Range    samples 1 ... 255; a count above samples is limited to it
 * Rounding none: exact
 * Errors   none
 * Context  any; no division, no loop */
#include <stdbool.h>
#include <stdint.h>

#include "fx/codegen.h"
#include "fx/q.h"

/** True while the condition has held in this and the (samples - 1) calls before. Calls that are not inlined would add
 * some 100 instructions to a step of the 1 kHz task. */
static inline FX_INLINED_IF_OPTIMISED bool debounce_holds(uint8_t *count, bool condition, uint8_t samples)
{
    *count = condition ? (uint8_t)fx_min_s32(*count + 1, samples) : 0;
    return *count >= samples;
}

/** The flag while debounce_holds() is true, else 0. */
static inline uint32_t debounce_step(uint8_t *count, bool condition, uint8_t samples, uint32_t flag)
{
    return debounce_holds(count, condition, samples) ? flag : 0U;
}

#endif
