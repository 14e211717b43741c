/* SPDX-License-Identifier: Apache-2.0 */
/* Reset and vector table of a Cortex-M processor. Nothing of a C library's start-up is linked. */
#include <stdint.h>

#include "handlers.h"

/* Write: the numbers of the interrupts in your processor's manual. */
#define IRQ_PERIOD 0
#define IRQ_TASK 1
#define IRQ_COUNT 2

#define CPACR (*(volatile uint32_t *)0xE000ED88U) /* coprocessor access: the same on every Cortex-M */
#define CPACR_FPU (0xFU << 20)

/* From the linker script. */
extern uint32_t stack_top[], data_start[], data_end[], bss_start[], bss_end[];
extern const uint32_t data_load[];

/* Write: disable the gate outputs, then reset. */
static void fault_handler(void)
{
    for (;;) {
    }
}

void reset_handler(void)
{
    CPACR = CPACR | CPACR_FPU; /* main() computes in single precision */
    __asm__ volatile("dsb\n isb" ::: "memory");
    const uint32_t *from = data_load;
    for (uint32_t *to = data_start; to < data_end; to++, from++) {
        *to = *from;
    }
    for (uint32_t *to = bss_start; to < bss_end; to++) {
        *to = 0;
    }
    (void)main();
}

typedef void (*vector_t)(void);

__attribute__((section(".vectors"), used)) static const vector_t vectors[16 + IRQ_COUNT] = {
    [0] = (vector_t)(uintptr_t)stack_top,
    [1] = reset_handler,
    [2 ... 13] = fault_handler,
    [14] = mrai_handler, /* PendSV */
    [15] = fault_handler,
    [16 + IRQ_PERIOD] = period_handler,
    [16 + IRQ_TASK] = task_handler,
};
