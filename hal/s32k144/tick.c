/* SPDX-License-Identifier: Apache-2.0 */
#include "hal/s32k144/tick.h"

#include "hal/s32k144/registers.h"

#define LOADED_LOOPS 32

static uint32_t pwm_ticks;

void tick_init(uint32_t period_ticks)
{
    pwm_ticks = period_ticks;
    LPIT0->MCR = LPIT_MCR_M_CEN;
    LPIT0->MIER = LPIT_MIER_TIE0;
    LPIT0->TVAL0 = 9U * period_ticks + period_ticks / 4U - 1U;
}

void tick_start(void)
{
    LPIT0->TCTRL0 = LPIT_TCTRL0_T_EN;
}

/* The second value waits in the timer until the first has expired; written before the first is loaded, it would
 * replace it. Loading takes four ticks of 28 MHz, 16 of the core. */
void tick_continue(void)
{
    for (int k = 0; k < LOADED_LOOPS; k++) {
        __asm__ volatile("nop");
    }
    LPIT0->TVAL0 = 10U * pwm_ticks - 1U;
}

void tick_cleared(void)
{
    LPIT0->MSR = LPIT_MSR_TIF0;
    (void)LPIT0->MSR; /* the write has arrived before the interrupt returns */
}
