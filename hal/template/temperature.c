/* SPDX-License-Identifier: Apache-2.0 */
#include "hal/temperature.h"

/* Write: convert the sensor's voltage to tenths of a degree; a broken or shorted sensor is
 * TEMPERATURE_OUT_OF_RANGE, none at all TEMPERATURE_UNKNOWN. */
int16_t hal_temperature_winding_dC(void)
{
    return TEMPERATURE_UNKNOWN;
}

int16_t hal_temperature_inverter_dC(void)
{
    return TEMPERATURE_UNKNOWN;
}

int16_t hal_temperature_processor_dC(void)
{
    return TEMPERATURE_UNKNOWN;
}
