/* SPDX-License-Identifier: Apache-2.0 */
#ifndef SAFETY_WINDING_TYPES_H
#define SAFETY_WINDING_TYPES_H
/** What the monitors know of the winding.
 * Source   docs/theory/monitors.md (MN-32)
 * Units    per unit
 * Range    resistances below 1/4
 * Errors   none: values only
 * Context  values only */
#include "fx/q.h"

/** Resistance at the winding's temperature, or in the middle of its range where that is unknown; its largest error. */
typedef struct {
    q16_t r, error;
} winding_resistance_t;

#endif
