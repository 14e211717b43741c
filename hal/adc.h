/* SPDX-License-Identifier: Apache-2.0 */
#ifndef HAL_ADC_H
#define HAL_ADC_H
/** Phase currents and dc voltage, all sampled at the same instant: the start of the PWM period.
 * Source   docs/howto/port.md
 * Units    right-aligned counts of the converter that motor.toml names (adc_bits)
 * Errors   none here; a value at the end of the range is returned as it is, and the monitors evaluate it
 * Context  fast ISR, once per period, after the conversion has finished */
#include "types/samples.h"

void hal_adc_read(adc_counts_t *counts);

#endif
