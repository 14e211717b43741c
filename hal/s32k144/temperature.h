/* SPDX-License-Identifier: Apache-2.0 */
#ifndef HAL_S32K144_TEMPERATURE_H
#define HAL_S32K144_TEMPERATURE_H
/** Temperature of the processor itself, from its sensor on ADC0.
 *   T = 25 degrees - (count - 607) 5 V/4096/1.564 mV/K
 * Source   README.md, temperatures: sensor constants assumed, not found in a data sheet
 * Units    tenths of a degree Celsius
 * Context  1 kHz task */
#include <stdint.h>

int16_t temperature_die_dC(void);

#endif
