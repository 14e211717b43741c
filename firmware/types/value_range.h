/* SPDX-License-Identifier: Apache-2.0 */
#ifndef TYPES_VALUE_RANGE_H
#define TYPES_VALUE_RANGE_H
/** The range of a value in SI that is kept in a fixed-point format.
 * Source   docs/howto/xcp.md
 * Units    SI, those of the value
 * Range    lo ... hi; a magnitude below `least`, except 0, is refused: the format would make it zero
 * Errors   NaN is in no range
 * Context  values only */
#include <stdbool.h>

typedef struct {
    float lo, hi;
    float least;
} value_range_t;

static inline bool value_range_holds(const value_range_t *range, float value)
{
    const float magnitude = (value < 0.0F) ? -value : value;
    const bool survives = magnitude == 0.0F || magnitude >= range->least;
    return value >= range->lo && value <= range->hi && survives;
}

#endif
