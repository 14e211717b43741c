/* SPDX-License-Identifier: Apache-2.0 */
#ifndef HAL_S32K144_EXCITATION_H
#define HAL_S32K144_EXCITATION_H
/** Excitation of a resolver whose windings the converters read: a square wave of the PWM's frequency, which the board
 * filters and amplifies. From there to the windings it lags by a quarter of its period, so that sine and cosine have
 * their negative peak where the output rises. It rises where the converters sample them; the product with -1 is the
 * demodulation (SINCOS_SIGN). Without ANGLE_EXCITED there is no excitation, and nothing here does anything but wait.
 * Source   README.md, resolver at the converters
 * Units    period_ticks: one PWM period in ticks of FTM0
 * Errors   none here: without an excitation sine and cosine are 0, which the band refuses
 * Context  start-up, before the PWM starts; excitation_first(), excitation_pass(): on the clock of clock_first() */
#include <stdint.h>

#include "hal/s32k144/clock.h"
#include "hal/s32k144/core.h"

#define EXCITATION_FIRST_PER_S 10000U /* length of a measurement of the speed without an excitation */

#if ANGLE_EXCITED
/** The output is switched by software until the windings have settled; from the counter's start on by the timer. */
void excitation_start(uint32_t period_ticks);
/** The same, and until the converters have been calibrated; then sine and cosine may be sampled. */
void excitation_first(void);
/** Until they may be sampled again; how often that is possible per second. */
float excitation_pass(void);
#else
static inline void excitation_start(uint32_t period_ticks)
{
    (void)period_ticks;
}

static inline void excitation_first(void)
{
}

static inline float excitation_pass(void)
{
    core_pass(CLOCK_FIRST_HZ / EXCITATION_FIRST_PER_S);
    return (float)EXCITATION_FIRST_PER_S;
}
#endif

#endif
