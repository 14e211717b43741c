/* SPDX-License-Identifier: Apache-2.0 */
#include "hal/s32k144/excitation.h"

#include "hal/s32k144/pwm.h"
#include "hal/s32k144/registers.h"
#include "hal/s32k144/sampling.h"

#if ANGLE_EXCITED
#define SETTLING_PERIODS 10U /* a filter of quality 2 at its resonance has settled to 1e-6 */

static void pulse(uint32_t high, uint32_t low)
{
    pwm_hold_pulse(true);
    core_pass(high);
    pwm_hold_pulse(false);
    core_pass(low);
}

/* The last low time is shorter: the counter starts as long before the next rise as in each of its own periods. */
void excitation_start(uint32_t period_ticks)
{
    const uint32_t half = period_ticks / 2U;
    for (uint32_t k = 1; k < SETTLING_PERIODS; k++) {
        pulse(half, half);
    }
    pulse(half, half - SAMPLING_ANGLE_TICKS);
    pwm_pulse(SAMPLING_ANGLE_TICKS, SAMPLING_ANGLE_TICKS + half);
}

static uint32_t first_period(void)
{
    return (FTM0->MOD + 1U) * (CLOCK_FIRST_HZ / 1000000U) / (CLOCK_CORE_HZ / 1000000U);
}

/* Not shorter than the calibration: waiting for its end without pulses would lose amplitude and phase. If it does not
 * end, the watchdog resets. */
void excitation_first(void)
{
    for (uint32_t k = 0; k < SETTLING_PERIODS || sampling_first_calibrates(); k++) {
        (void)excitation_pass();
    }
}

float excitation_pass(void)
{
    const uint32_t period = first_period(), half = period / 2U;
    pulse(half, half);
    return (float)CLOCK_FIRST_HZ / (float)period;
}
#endif
