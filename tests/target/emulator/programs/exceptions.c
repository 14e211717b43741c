/* SPDX-License-Identifier: Apache-2.0 */
/* Three interrupts of different priority pend each other and use floating point. Then the core sleeps and is woken by
 * the timer, until the watchdog resets it. */
#include "bare.h"

enum { LOW = 10, MIDDLE = 11, HIGH = 12, LPIT = 48 };

volatile uint32_t order[16], at, ticks, cause, masked, wrong, again;
volatile float value;

void reset(void);
void low(void);
void middle(void);
void high(void);
void tick(void);

__attribute__((section(".vectors"), used)) const vector_t vectors[16 + 64] = {
    (vector_t)STACK_TOP, reset, [16 + LOW] = low, [16 + MIDDLE] = middle, [16 + HIGH] = high, [16 + LPIT] = tick,
};

static void record(uint32_t what)
{
    order[at] = what;
    at = at + 1U;
}

/* Keeps two values in registers, and the flags of their comparison, while the interrupt that it pends may run. */
static float busy(float from, uint32_t pend)
{
    register float a = from * 3.0F, b = from * 5.0F;
    uint32_t flags;
    __asm__ volatile("vcmp.f32 %0, %1" : "+t"(a), "+t"(b));
    ISPR(0) = 1U << pend;
    __asm__ volatile("dsb\n isb\n vmrs %2, fpscr" : "+t"(a), "+t"(b), "=r"(flags)::"memory");
    wrong += 1U - (flags >> 31); /* flag N: a < b. Without a branch, because a test counts the instructions */
    return a + b;
}

void low(void)
{
    record(1);
    wrong += busy(1.0F, HIGH) != 8.0F;
    record(2);
    wrong += busy(2.0F, MIDDLE) != 16.0F;
    record(3);
}

void middle(void)
{
    record(4);
    if (again == 0U) {
        again = 1;
        wrong += busy(3.0F, LOW) != 24.0F; /* waits: it is of lower priority */
    }
    record(5);
}

void high(void)
{
    record(6);
    value = value * 2.0F;
}

void tick(void)
{
    REG(0x4003700CU) = 1;
    ticks = ticks + 1U;
    if (ticks == 1U) {
        cause = REG(0x4007F008U);
    }
}

static void prepare(void)
{
    CPACR = 15U << 20;
    __asm__ volatile("dsb\n isb" ::: "memory");
    at = ticks = wrong = again = 0;
    value = 1.0F;
    IPR(LOW) = 3U << 4;
    IPR(MIDDLE) = 2U << 4;
    IPR(HIGH) = 1U << 4;
    IPR(LPIT) = 4U << 4;
    ISER(0) = 1U << LOW | 1U << MIDDLE | 1U << HIGH;
    ISER(1) = 1U << (LPIT - 32);
}

static void start_timer(void)
{
    REG(0x40064304U) = 0x100U; /* FIRCDIV2 1/1: 48 MHz */
    PCC(0xDCU) = 3U << 24;
    PCC(0xDCU) = 3U << 24 | CLOCK_ON;
    REG(0x40037008U) = 1;         /* module on */
    for (int k = 0; k < 8; k++) { /* other registers may be written after four clocks */
        __asm__ volatile("nop");
    }
    REG(0x40037010U) = 1;           /* channel 0 interrupts */
    REG(0x40037020U) = 48000U - 1U; /* 1 ms */
    REG(0x40037028U) = 1;
}

__attribute__((used)) void reset(void)
{
    WDOG_CNT = 0xD928C520U;
    WDOG_WIN = 0;
    WDOG_TOVAL = 1280U; /* 10 ms, never serviced */
    WDOG_CS = 0x21A0U;
    prepare();
    __asm__ volatile("cpsid i" ::: "memory");
    ISPR(0) = 1U << HIGH;
    masked = at; /* nothing has run yet */
    __asm__ volatile("cpsie i\n isb" ::: "memory");
    ISPR(0) = 1U << LOW;
    __asm__ volatile("dsb\n isb" ::: "memory");
    wrong += busy(4.0F, HIGH) != 32.0F;
    start_timer();
    for (;;) {
        __asm__ volatile("wfi");
    }
}
