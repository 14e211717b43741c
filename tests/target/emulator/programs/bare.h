/* SPDX-License-Identifier: Apache-2.0 */
#ifndef EMULATOR_PROGRAMS_BARE_H
#define EMULATOR_PROGRAMS_BARE_H
/** Definitions for test programs without start-up code: vectors, registers by address. A test reads the results.
 * Context  test programs only; variables in .data and .bss are not initialised */
#include <stdint.h>

#define REG(address) (*(volatile uint32_t *)(address))
#define STACK_TOP 0x20001000U
#define PCC(offset) REG(0x40065000U + (offset))
#define CLOCK_ON (1U << 30)
#define WDOG_CNT REG(0x40052004U)
#define WDOG_CS REG(0x40052000U)
#define WDOG_TOVAL REG(0x40052008U)
#define WDOG_WIN REG(0x4005200CU)
#define ISER(n) REG(0xE000E100U + 4U * (n))
#define ISPR(n) REG(0xE000E200U + 4U * (n))
#define IPR(n) (*(volatile uint8_t *)(0xE000E400U + (n)))
#define CPACR REG(0xE000ED88U)

typedef void (*vector_t)(void);

static inline void watchdog_off(void)
{
    WDOG_CNT = 0xD928C520U;
    WDOG_TOVAL = 0xFFFFU;
    WDOG_CS = 0x2120U; /* disabled, UPDATE, LPO, 32-bit commands */
}

#endif
