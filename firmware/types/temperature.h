/* SPDX-License-Identifier: Apache-2.0 */
#ifndef TYPES_TEMPERATURE_H
#define TYPES_TEMPERATURE_H
/** The values for a temperature that is not known: there is no sensor, or the sensor is out of its range (broken or
 * shorted). The two differ: a machine without the sensor is not derated, one whose sensor is lost is.
 * Source   docs/theory/limits.md, section 3
 * Units    temperatures are int16_t in tenths of a degree C
 * Range    the two lowest values of int16_t; every other value is a temperature
 * Errors   none: values only
 * Context  values only */
#include <stdbool.h>
#include <stdint.h>

#define TEMPERATURE_UNKNOWN ((int16_t)INT16_MIN)
#define TEMPERATURE_OUT_OF_RANGE ((int16_t)(INT16_MIN + 1))

static inline bool temperature_is_known(int16_t dC)
{
    return dC > TEMPERATURE_OUT_OF_RANGE;
}

#endif
