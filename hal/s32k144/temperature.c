/* SPDX-License-Identifier: Apache-2.0 */
#include "hal/temperature.h"

#include "hal/s32k144/die.h"
#include "hal/s32k144/ntc.h"
#include "hal/s32k144/sampling.h"

int16_t hal_temperature_winding_dC(void)
{
    return ntc_dC(sampling_winding());
}

int16_t hal_temperature_inverter_dC(void)
{
    return ntc_dC(sampling_inverter());
}

int16_t hal_temperature_processor_dC(void)
{
    return die_dC(sampling_die());
}
