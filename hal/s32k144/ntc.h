/* SPDX-License-Identifier: Apache-2.0 */
#ifndef HAL_S32K144_NTC_H
#define HAL_S32K144_NTC_H
/** Temperature of an NTC against ground with a pull-up of its own 25 degree resistance, from a 12-bit count.
 *   count/4096 = r/(1 + r),  r = exp(B (1/T - 1/298.15 K)),  B = 3435 K; straight lines between nodes every 10 K
 * Source   the beta equation of a thermistor; the table is recomputed by its test
 * Units    tenths of a degree Celsius
 * Range    -40 ... 300 degrees: beyond every temperature at which the drive may trip
 * Rounding within 0.7 K of the equation up to 150 degrees, 4 K at 300, where a count is 6 K
 * Errors   TEMPERATURE_OUT_OF_RANGE outside the range: sensor open or shorted
 * Context  1 kHz task; one division */
#include <stdint.h>

int16_t ntc_dC(uint16_t count);

#endif
