/* SPDX-License-Identifier: Apache-2.0 */
#ifndef HAL_ADC_H
#define HAL_ADC_H
/** The converters of phase currents and dc voltage.
 *   read            all of them, sampled at the same instant: the start of the PWM period
 *   latest          the counts of the currents again, for the second level: a function of its own, so that read()
 *                   remains a part of the fast ISR
 *   known_permille  reading of a known voltage that does not come from the converters' reference, as thousandths of the
 *                   correct reading: 1000 while the reference is right. A wrong reference scales all currents by the
 *                   same factor, which the currents themselves do not show
 * Source   docs/howto/port.md; docs/theory/monitors.md (MN-37)
 * Units    right-aligned counts of the converter that motor.toml names (adc_bits); thousandths
 * Range    counts 0 ... 2^adc_bits - 1; thousandths 0 ... 32767
 * Errors   a value at the end of the range is returned as it is, and the monitors evaluate it; HAL_ADC_NOTHING_KNOWN:
 *          the port has no such voltage, and the integrator supervises the reference
 * Context  hal_adc_read(): fast ISR, once per period, after the conversion has finished; hal_adc_latest():
 *          1 kHz task with a bus, when it begins; hal_adc_known_permille(): 1 kHz task */
#include <stdint.h>

#include "types/samples.h"

#define HAL_ADC_NOTHING_KNOWN ((int16_t)-1)

void hal_adc_read(adc_counts_t *counts);
void hal_adc_latest(current_counts_t *counts);
int16_t hal_adc_known_permille(void);

#endif
