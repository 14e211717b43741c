/* SPDX-License-Identifier: Apache-2.0 */
#ifndef HAL_TEMPERATURE_H
#define HAL_TEMPERATURE_H
/** Temperatures: winding (NTC), inverter, and the processor, which is only measured and limits nothing.
 * Source   docs/howto/port.md
 * Units    tenths of a degree Celsius
 * Range    -3276.6 ... 3276.7 degrees
 * Errors   TEMPERATURE_UNKNOWN: no sensor; TEMPERATURE_OUT_OF_RANGE: it is broken or shorted. The range of a sensor
 *          must reach beyond the temperatures at which the drive trips, thermal.*_trip_C of the motor data
 * Context  1 kHz task */
#include <stdint.h>

#include "types/temperature.h"

int16_t hal_temperature_winding_dC(void);
int16_t hal_temperature_inverter_dC(void);
int16_t hal_temperature_processor_dC(void);

#endif
