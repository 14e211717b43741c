/* SPDX-License-Identifier: Apache-2.0 */
#ifndef TYPES_TEMPERATURE_H
#define TYPES_TEMPERATURE_H
/** The one value for a temperature that is not known: no sensor, or one that is broken or shorted.
 * Units    temperatures are int16_t in tenths of a degree C
 * Context  a value only */
#include <stdint.h>

#define TEMPERATURE_UNKNOWN ((int16_t)INT16_MIN)

#endif
