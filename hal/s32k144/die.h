/* SPDX-License-Identifier: Apache-2.0 */
#ifndef HAL_S32K144_DIE_H
#define HAL_S32K144_DIE_H
/** Temperature of the processor itself from a 12-bit count of its sensor's voltage, which falls with the temperature.
 *   T = 25 degrees - (count - 606.6) 5 V/4096/1.564 mV/K
 * Source   README.md, temperatures: the constants are a sister chip's
 * Units    tenths of a degree Celsius
 * Range    -50 ... 200 degrees
 * Rounding towards 25 degrees, 1 LSB, and 0.4 K of the offset
 * Errors   TEMPERATURE_UNKNOWN outside the range: no such sensor
 * Context  1 kHz task */
#include <stdint.h>

#include "hal/temperature.h"

#define DIE_COUNT_25 607
#define DIE_DC_PER_COUNT_Q8 1998 /* 7.805 in Q8 */
#define DIE_MIN_DC (-500)
#define DIE_MAX_DC 2000

static inline int16_t die_dC(uint16_t count)
{
    const int32_t dC = 250 - (((int32_t)count - DIE_COUNT_25) * DIE_DC_PER_COUNT_Q8) / 256;
    return (dC < DIE_MIN_DC || dC > DIE_MAX_DC) ? (int16_t)TEMPERATURE_UNKNOWN : (int16_t)dC;
}

#endif
