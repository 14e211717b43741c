/* SPDX-License-Identifier: Apache-2.0 */
/* One wrong access, chosen by CASE. */
#include "bare.h"

volatile uint32_t seen;

void reset(void);
__attribute__((section(".vectors"), used)) const vector_t vectors[16] = {(vector_t)STACK_TOP, reset};

#if CASE >= 16 && CASE <= 18
#define VALID (1U << 24)

/* Switches to 112 MHz, by way of half of it unless at_once. */
static void high_speed(uint32_t at_once)
{
    REG(0x40064104U) = 0x101U;
    REG(0x40064108U) = 0x24U;
    REG(0x40064100U) = 1;
    while ((REG(0x40064100U) & VALID) == 0U) {
    }
    REG(0x40064604U) = 0x302U;
    REG(0x40064608U) = 12U << 16;
    REG(0x40064600U) = 1;
    while ((REG(0x40064600U) & VALID) == 0U) {
    }
    REG(0x4006401CU) = 0x06000013U;
    if (at_once == 0U) {
        REG(0x40064014U) = 0x06010013U;
    }
    REG(0x4007E008U) = 0x80;
    REG(0x4007E00CU) = 0x60;
}
#endif

__attribute__((used)) void reset(void)
{
    watchdog_off();
#if CASE == 1 /* SIM.PLATCGC is in the manual, but not in the model */
    REG(0x40048040U) = 0;
#elif CASE == 2  /* nothing is at this offset */
    seen = REG(0x40064044U);
#elif CASE == 3  /* no clock for FTM0 */
    REG(0x40038008U) = 1000;
#elif CASE == 4  /* FTM0.MOD has 16 bits */
    PCC(0xE0U) = CLOCK_ON;
    REG(0x40038008U) = 0x10000;
#elif CASE == 5  /* a peripheral that is not modelled: CAN1 */
    seen = REG(0x40025000U);
#elif CASE == 6  /* a byte of a 32-bit register */
    PCC(0xE0U) = CLOCK_ON;
    *(volatile uint8_t *)0x40038008U = 1;
#elif CASE == 7  /* flash cannot be written */
    REG(0x00008000U) = 1;
#elif CASE == 8  /* below the RAM */
    REG(0x1FFF7FFCU) = 1;
#elif CASE == 9  /* a register of the core: MPU */
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
#elif CASE >= 16 && CASE <= 18
    high_speed(CASE == 16 ? 1U : 0U);
#if CASE == 17   /* a clock gate while in HSRUN */
    PCC(0xE0U) = CLOCK_ON;
#elif CASE == 18 /* PMPROT a second time */
    REG(0x4007E008U) = 0xA0;
#endif
#elif CASE == 19 || CASE == 20 || CASE == 21 /* converter: calibration not cleared, short samples, not calibrated */
    REG(0x40064304U) = 0x300U; /* FIRCDIV2: 12 MHz */
    PCC(0xECU) = 3U << 24;
    PCC(0xECU) = 3U << 24 | CLOCK_ON;
    REG(0x4003B040U) = 4; /* 12 bits */
#if CASE != 19
    for (uint32_t at = 0xB4U; at <= 0xCCU; at += 4U) {
        REG(0x4003B000U + at) = 0;
    }
#endif
#if CASE != 21
    REG(0x4003B094U) = 0x87U;
    while ((REG(0x4003B094U) & 0x80U) != 0U) {
    }
#endif
    REG(0x4003B044U) = CASE == 20 ? 1U : 12U;
    REG(0x4003B000U) = 0;
#elif CASE == 22               /* a timer register right after the module was enabled */
    REG(0x40064304U) = 0x700U; /* FIRCDIV2: 1/64 */
    PCC(0xDCU) = 3U << 24;
    PCC(0xDCU) = 3U << 24 | CLOCK_ON;
    REG(0x40037008U) = 1;
    REG(0x40037010U) = 1;
#elif CASE == 23 || CASE == 24 /* FlexCAN: RFEN outside freeze mode; message memory not initialised */
    REG(0x40064100U) = 1;
    REG(0x40064104U) = 0x101U;
    PCC(0x90U) = CLOCK_ON;
    PCC(0x134U) = CLOCK_ON;
    REG(0x4004D010U) = 0x500U;
    REG(0x4004D014U) = 0x500U;
    REG(0x40024000U) = 0x5080000FU; /* frozen */
    for (uint32_t at = 0; CASE == 23 && at < 512U; at += 4U) {
        REG(0x40024080U + at) = 0;
    }
    REG(0x40024000U) = 0x0080000FU; /* normal */
    REG(0x40024000U) = 0x2080000FU; /* RFEN */
#elif CASE == 25               /* a timer without its pins */
    PCC(0xE0U) = CLOCK_ON;
    REG(0x40038000U) = 8;
#elif CASE == 26               /* a line that is no output */
    PCC(0x12CU) = CLOCK_ON;
    REG(0x4004B000U) = 0x100U;
    REG(0x400FF084U) = 1;
#elif CASE == 27               /* RAM that keeps its content over a reset; the stack lies in it, too, but is not used */
    REG(0x40048004U) = 0x200000U;
    seen = REG(0x20000800U);
#elif CASE == 28               /* the oscillator has not started yet */
    REG(0x40064100U) = 1;
    REG(0x40064014U) = 0x01000001U;
#elif CASE == 29               /* RAM is used, then closed */
    seen = REG(0x20000800U);
    REG(0x40048004U) = 0x200000U;
    seen = REG(0x20000804U);
#elif CASE == 30               /* trap of divisions by zero */
    REG(0xE000ED14U) = 0x210U;
#elif CASE == 31
    __asm__ volatile("svc #0");
#elif CASE == 32
    __asm__ volatile("bkpt #0");
#elif CASE == 33 /* no wrong access: for ever an IT block of which every second instruction is skipped. Unicorn stops
                    within it because a page of 1 KiB ends there. */
    __asm__ volatile(
        "movs r0, #0\n\tmovs r1, #0\n\tmovs r2, #0\n\tmovs r3, #0\n\tb 1f\n\t.balign 1024\n\t.space 1018\n"
        "1:\tcmp r1, #0\n\titete eq\n\taddeq r0, #1\n\taddne r0, #1\n\taddeq r0, #1\n\taddne r0, #1\n\tb 1b" ::
            : "r0", "r1", "r2", "r3", "cc");
#endif
    for (;;) {
    }
}
