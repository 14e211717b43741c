/* SPDX-License-Identifier: Apache-2.0 */
#include "hal/temperature.h"

#include "hal/s32k144/ntc.h"
#include "hal/s32k144/sampling.h"
#include "hal/s32k144/temperature.h"

#define DIE_COUNT_25 607
#define DIE_DC_PER_COUNT_Q8 1998 /* 7.805 in Q8 */

int16_t hal_temperature_winding_dC(void)
{
    return ntc_dC(sampling_winding());
}

int16_t hal_temperature_inverter_dC(void)
{
    return ntc_dC(sampling_inverter());
}

int16_t temperature_die_dC(void)
{
    const int32_t beyond = (int32_t)sampling_die() - DIE_COUNT_25;
    return (int16_t)(250 - (beyond * DIE_DC_PER_COUNT_Q8) / 256);
}
