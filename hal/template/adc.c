/* SPDX-License-Identifier: Apache-2.0 */
#include "hal/adc.h"

/* Write: copy the results of the conversions that the PWM timer triggered at the start of this period.
 * Until then all counts are zero: a phase current at the end of its range, for which the over-current monitor latches
 * a fault. An unfinished port therefore never enables switching. */
void hal_adc_read(adc_counts_t *counts)
{
    *counts = (adc_counts_t){0};
}

/* Write: the results of the three currents again, without waiting for new ones. */
void hal_adc_latest(current_counts_t *counts)
{
    *counts = (current_counts_t){0};
}

/* Write: a thousand times what a conversion of a known voltage gave, divided by what it should have given. The voltage
 * must not come from the converters' reference: a bandgap of the processor, or a reference of its own at a pin. */
int16_t hal_adc_known_permille(void)
{
    return HAL_ADC_NOTHING_KNOWN;
}
