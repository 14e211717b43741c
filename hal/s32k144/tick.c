/* SPDX-License-Identifier: Apache-2.0 */
#include "hal/s32k144/tick.h"

#include "hal/s32k144/registers.h"

#define FOUR_TICKS_LOOPS 32 /* at least 4 ticks of 28 MHz, which are 16 of the core */

static uint32_t pwm_ticks, step_ticks,
    first_ticks; /* a PWM period; a step; from the start of the PWM to the first tick */

static void pass_four_ticks(void)
{
    for (int k = 0; k < FOUR_TICKS_LOOPS; k++) {
        __asm__ volatile("nop");
    }
}

void tick_init(uint32_t period_ticks, uint32_t periods)
{
    pwm_ticks = period_ticks;
    step_ticks = periods * period_ticks;
    LPIT0->MCR = LPIT_MCR_M_CEN;
    pass_four_ticks(); /* the timer accepts no other access before that */
    LPIT0->MIER = LPIT_MIER_TIE0;
    first_ticks = step_ticks - period_ticks + period_ticks / 4U;
    LPIT0->TVAL0 = first_ticks - 1U;
}

void tick_start(void)
{
    LPIT0->TCTRL0 = LPIT_TCTRL0_T_EN;
}

/* The second value waits in the timer until the first has expired; written before the first is loaded, it would
 * replace it. */
void tick_continue(void)
{
    pass_four_ticks();
    LPIT0->TVAL0 = step_ticks - 1U;
}

void tick_align(uint32_t elapsed)
{
    const uint32_t left = LPIT0->CVAL0;
    const uint32_t phase = (elapsed + left) % pwm_ticks; /* at which the step would end, instead of a quarter */
    LPIT0->TCTRL0 = 0;
    pass_four_ticks();
    LPIT0->TVAL0 = left + pwm_ticks + pwm_ticks / 4U - phase - 1U;
    tick_start();
    tick_continue();
}

void tick_cleared(void)
{
    LPIT0->MSR = LPIT_MSR_TIF0;
    (void)LPIT0->MSR; /* a read back, so that the write has arrived before the interrupt returns */
}
