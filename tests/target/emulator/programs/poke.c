/* SPDX-License-Identifier: Apache-2.0 */
/* One access that is wrong, chosen by CASE. */
#include "bare.h"

volatile uint32_t seen;

void reset(void);
__attribute__((section(".vectors"), used)) const vector_t vectors[16] = {(vector_t)STACK_TOP, reset};

__attribute__((used)) void reset(void)
{
    watchdog_off();
#if CASE == 1 /* SIM.PLATCGC is in the manual, but not in the model */
    REG(0x40048040U) = 0;
#elif CASE == 2 /* nothing is at this offset */
    seen = REG(0x40064044U);
#elif CASE == 3 /* no clock for FTM0 */
    REG(0x40038008U) = 1000;
#elif CASE == 4 /* FTM0.MOD has 16 bits */
    PCC(0xE0U) = CLOCK_ON;
    REG(0x40038008U) = 0x10000;
#elif CASE == 5 /* a peripheral that is not modelled: CAN1 */
    seen = REG(0x40025000U);
#elif CASE == 6 /* a byte of a 32-bit register */
    PCC(0xE0U) = CLOCK_ON;
    *(volatile uint8_t *)0x40038008U = 1;
#elif CASE == 7 /* flash cannot be written */
    REG(0x00008000U) = 1;
#elif CASE == 8 /* below the RAM */
    REG(0x1FFF7FFCU) = 1;
#elif CASE == 9 /* the core's own: MPU */
    REG(0xE000ED94U) = 1;
#elif CASE == 10 /* write protected after WPEN */
    PCC(0xE0U) = CLOCK_ON;
    REG(0x40038074U) = 0x40;
    REG(0x40038000U) = 8;
#elif CASE == 11 /* HSRUN without permission */
    REG(0x4007E00CU) = 0x60;
#elif CASE == 12 /* watchdog: neither unlock nor refresh */
    WDOG_CNT = 0x12345678U;
#elif CASE == 13 /* a vector without a handler */
    ISER(0) = 1U << 5;
    ISPR(0) = 1U << 5;
#elif CASE == 14 /* a reset request without its key */
    REG(0xE000ED0CU) = 4U;
#elif CASE == 15 /* floating point before CPACR allows it */
    ISER(0) = 1U << 5;
    volatile float x = 1.5F;
    x = x * x;
    ISPR(0) = 1U << 5;
#endif
    for (;;) {
    }
}
