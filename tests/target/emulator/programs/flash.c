/* SPDX-License-Identifier: Apache-2.0 */
/* Reads of the data flash, chosen by CASE: beside a command (1), through the cache after a command (2), after the cache
 * was invalidated (3) but with speculation (6), of an uncertain phrase (4), and with bus faults ignored (5). */
#include "bare.h"

#define FLASH REG(0x10000000U)
#define FTFC(offset) (*(volatile uint8_t *)(0x40020000U + (offset)))
#define PCCCR REG(0xE0082000U)
#define CCR REG(0xE000ED14U)

volatile uint32_t seen, failed;

void reset(void);
__attribute__((section(".vectors"), used)) const vector_t vectors[16] = {(vector_t)STACK_TOP, reset};

static inline void program(void)
{
    FTFC(7) = 0x07;
    FTFC(6) = 0x80;
    FTFC(5) = 0;
    FTFC(4) = 0;
    for (uint32_t k = 0; k < 8U; k++) {
        FTFC(8U + k) = (uint8_t)(k + 1U);
    }
    FTFC(0) = 0x80;
#if CASE != 1
    while ((FTFC(0) & 0x80U) == 0U) {
    }
#endif
}

__attribute__((used)) void reset(void)
{
    watchdog_off();
#if CASE != 6
    REG(0x40001404U) = 0x40000030U; /* no speculation on the data flash */
#endif
#if CASE <= 3 || CASE == 6
    PCCCR = 1;
    seen = FLASH;
    program();
#if CASE == 3 || CASE == 6
    PCCCR = 0x85000001U;
#endif
    seen = FLASH;
#else
#if CASE == 5
    CCR = CCR | 0x100U;
    __asm__ volatile("msr faultmask, %0" ::"r"(1) : "memory");
#endif
    failed = 0;
    for (uint32_t k = 0; k < 1000U; k++) {
        FTFC(0x2E) = 2;
        seen = FLASH;
        failed = failed + (FTFC(0x2E) >> 1);
    }
#endif
    for (;;) {
    }
}
