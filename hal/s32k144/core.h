/* SPDX-License-Identifier: Apache-2.0 */
#ifndef HAL_S32K144_CORE_H
#define HAL_S32K144_CORE_H
/** Registers of the Cortex-M4 itself, which the maker's SVD leaves out, and the priorities of this port's interrupts.
 * Source   Armv7-M Architecture Reference Manual, B3.2 and B3.4; README.md, interrupts
 * Context  start-up; pend and mask from any priority: single stores of set or clear registers */
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

typedef struct {
    volatile uint32_t ISER[8]; /* 0xE000E100 */
    uint8_t reserved0[0x60];
    volatile uint32_t ICER[8]; /* 0xE000E180 */
    uint8_t reserved1[0x60];
    volatile uint32_t ISPR[8]; /* 0xE000E200 */
    uint8_t reserved2[0x60];
    volatile uint32_t ICPR[8]; /* 0xE000E280 */
    uint8_t reserved3[0x160];
    volatile uint8_t IPR[240]; /* 0xE000E400, one byte each */
} nvic_t;
_Static_assert(offsetof(nvic_t, ICER) == 0x80 && offsetof(nvic_t, ISPR) == 0x100 && offsetof(nvic_t, ICPR) == 0x180 &&
                   offsetof(nvic_t, IPR) == 0x300,
               "NVIC");

#if defined(FAKE_REGISTERS)
extern nvic_t fake_nvic;
#define NVIC (&fake_nvic)
#else
#define NVIC ((nvic_t *)0xE000E100U)
#endif
#define SCB_VTOR (*(volatile uint32_t *)0xE000ED08U)
#define SCB_AIRCR (*(volatile uint32_t *)0xE000ED0CU)
#define SCB_CCR (*(volatile uint32_t *)0xE000ED14U)
#define SCB_CPACR (*(volatile uint32_t *)0xE000ED88U)
#define SYST_CSR (*(volatile uint32_t *)0xE000E010U)
#define SYST_RVR (*(volatile uint32_t *)0xE000E014U)
#define SYST_CVR (*(volatile uint32_t *)0xE000E018U)
#define SYST_CORE_CLOCK 5U       /* counts the core's clock, no interrupt */
#define SYST_COUNTFLAG 0x10000U
#define AIRCR_RESET 0x05FA0004U /* key, SYSRESETREQ */
#define CCR_BFHFNMIGN 0x100U    /* at the priority of FAULTMASK a bus fault of a data access is ignored */
#define CPACR_FPU 0x00F00000U   /* CP10 and CP11, full access */

#define IRQ_MRAI 69U /* FlexIO's, which has no clock here: only software pends it */

enum { PRIORITY_FAULT = 0, PRIORITY_FAST = 1, PRIORITY_MRAI = 2, PRIORITY_CAN = 3, PRIORITY_TICK = 4 };

static inline void core_irq_enable(uint32_t irq)
{
    NVIC->ISER[irq >> 5] = 1U << (irq & 31U);
}

static inline void core_irq_disable(uint32_t irq)
{
    NVIC->ICER[irq >> 5] = 1U << (irq & 31U);
}

static inline void core_irq_pend(uint32_t irq)
{
    NVIC->ISPR[irq >> 5] = 1U << (irq & 31U);
}

static inline void core_irq_clear(uint32_t irq)
{
    NVIC->ICPR[irq >> 5] = 1U << (irq & 31U);
}

/* A bus fault of a data access is ignored between the two calls: the access returns anything. */
static inline void core_ignore_bus_faults(bool ignore)
{
    if (ignore) {
        __asm__ volatile("msr faultmask, %0" ::"r"(1) : "memory");
        SCB_CCR = SCB_CCR | CCR_BFHFNMIGN;
    } else {
        __asm__ volatile("dsb" ::: "memory");
        SCB_CCR = SCB_CCR & ~CCR_BFHFNMIGN;
        __asm__ volatile("msr faultmask, %0" ::"r"(0) : "memory");
    }
}

/* Lets so many clocks of the core pass, up to 2^24; start-up only. */
#if defined(FAKE_REGISTERS)
void core_pass(uint32_t clocks);
#else
static inline void core_pass(uint32_t clocks)
{
    SYST_RVR = clocks - 1U;
    SYST_CVR = 0;
    SYST_CSR = SYST_CORE_CLOCK;
    while ((SYST_CSR & SYST_COUNTFLAG) == 0U) {
    }
    SYST_CSR = 0;
}
#endif

/* Four bits of priority, in the upper half of the byte. */
static inline void core_irq_priority(uint32_t irq, uint32_t priority)
{
    NVIC->IPR[irq] = (uint8_t)(priority << 4);
}

#endif
