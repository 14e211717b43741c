/* SPDX-License-Identifier: Apache-2.0 */
#include <stdint.h>

#include "hal/mps2/core.h"
#include "hal/mps2/semihosting.h"

extern uint32_t stack_top[], data_start[], data_end[], bss_start[], bss_end[];
extern const uint32_t data_load[];

int main(void);

__attribute__((used)) void fault_handler(void)
{
    semihosting_print("fault\n");
    semihosting_exit(2);
}

__attribute__((used)) void reset_handler(void)
{
    SCB_CPACR = SCB_CPACR | CPACR_FPU;
    __asm__ volatile("dsb\n isb" ::: "memory");
    const uint32_t *from = data_load;
    for (uint32_t *to = data_start; to < data_end; to++, from++) {
        *to = *from;
    }
    for (uint32_t *to = bss_start; to < bss_end; to++) {
        *to = 0;
    }
    semihosting_exit((uint32_t)main());
}

typedef void (*vector_t)(void);

__attribute__((section(".vectors"), used)) static const vector_t vectors[16 + IRQ_TASK + 1] = {
    [0] = (vector_t)(uintptr_t)stack_top,
    [1] = reset_handler,
    [2 ... 13] = fault_handler,
    [14] = pendsv_handler,
    [15] = systick_handler,
    [16 ... 16 + IRQ_TASK - 1] = fault_handler,
    [16 + IRQ_TASK] = task_handler,
};
