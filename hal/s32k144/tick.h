/* SPDX-License-Identifier: Apache-2.0 */
#ifndef HAL_S32K144_TICK_H
#define HAL_S32K144_TICK_H
/** The 1 kHz tick: LPIT0 channel 0, a quarter period after every N-th start of the PWM period.
 * Source   README.md, time
 * Units    period_ticks: one PWM period in ticks of the 28 MHz timer; periods: N
 * Context  start-up; tick_start() right before pwm_start(), tick_continue() right after it;
 *          tick_align(): at any time with interrupts masked, elapsed: ticks since the start of the PWM period; the step
 *          that runs is lengthened by 1/4 to 5/4 of a period. tick_cleared(): first in the tick interrupt */
#include <stdint.h>

void tick_init(uint32_t period_ticks, uint32_t periods);
void tick_start(void);
void tick_continue(void);
void tick_align(uint32_t elapsed);
void tick_cleared(void);

#endif
