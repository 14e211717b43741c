/* SPDX-License-Identifier: Apache-2.0 */
/* Calls a function in the flash and one in RAM again and again, which the test writes. */
#include "bare.h"

void reset(void);
uint32_t in_flash(void);
__attribute__((section(".vectors"), used)) const vector_t vectors[16] = {(vector_t)STACK_TOP, reset};
volatile uint16_t in_ram[4];
volatile uint32_t is_written, answer[2], cycles;

__attribute__((noinline, noipa)) uint32_t in_flash(void)
{
    return 1;
}

__attribute__((used)) void reset(void)
{
    watchdog_off();
    REG(0xE000EDFCU) = 1U << 24;
    REG(0xE0001000U) = 1;
    uint32_t (*const function)(void) = (uint32_t (*)(void))((uint32_t)in_ram | 1U);
    for (;;) {
        answer[0] = in_flash();
        if (is_written != 0U) {
            const uint32_t before = REG(0xE0001004U);
            answer[1] = function();
            cycles = REG(0xE0001004U) - before;
        }
    }
}
