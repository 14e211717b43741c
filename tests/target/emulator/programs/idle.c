/* SPDX-License-Identifier: Apache-2.0 */
/* Does nothing while a test accesses the peripherals from outside. Each interrupt is counted, and disabled after it has
 * been taken `taken_max` times. */
#include "bare.h"

enum { IRQS = 123 };

volatile uint32_t taken[IRQS], taken_max;

void reset(void);
void count(void);

__attribute__((section(".vectors"), used)) const vector_t vectors[16 + IRQS] = {
    (vector_t)STACK_TOP,
    reset,
    [16 ... 16 + IRQS - 1] = count,
};

void count(void)
{
    uint32_t vector;
    __asm__ volatile("mrs %0, ipsr" : "=r"(vector));
    const uint32_t irq = vector - 16U;
    taken[irq]++;
    if (taken[irq] >= taken_max) {
        REG(0xE000E180U + 4U * (irq / 32U)) = 1U << irq % 32U;
    }
}

__attribute__((used)) void reset(void)
{
    watchdog_off();
    taken_max = 1;
    for (uint32_t irq = 0; irq < IRQS; irq++) {
        taken[irq] = 0;
        ISER(irq / 32U) = 1U << irq % 32U;
    }
    for (;;) {
    }
}
