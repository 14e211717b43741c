/* SPDX-License-Identifier: Apache-2.0 */
#include "hal/s32k144/temperature.h"

#include "hal/s32k144/die.h"
#include "hal/s32k144/ntc.h"
#include "hal/s32k144/sampling.h"
#include "hal/temperature.h"

static uint32_t temperature_steps; /* tests/target/emulator/shadow.c reads it by this name */
static int16_t winding_dC, inverter_dC;

/* The first step needs both. Before the converters run, and with a broken sensor, there is no temperature: each step
 * tries again, which takes no division. */
void temperature_tick(void)
{
    const uint32_t turn = temperature_steps % TEMPERATURE_CYCLE_STEPS;
    if (turn == TEMPERATURE_WINDING_TURN || !temperature_is_known(winding_dC)) {
        winding_dC = ntc_dC(sampling_winding());
    }
    if (turn == TEMPERATURE_INVERTER_TURN || temperature_steps == 0U || !temperature_is_known(inverter_dC)) {
        inverter_dC = ntc_dC(sampling_inverter());
    }
    temperature_steps++;
}

int16_t hal_temperature_winding_dC(void)
{
    return winding_dC;
}

int16_t hal_temperature_inverter_dC(void)
{
    return inverter_dC;
}

int16_t hal_temperature_processor_dC(void)
{
    return die_dC(sampling_die());
}
