/* SPDX-License-Identifier: Apache-2.0 */
/* Records step by step how a Cortex-M4F handles exceptions, masks, priorities, SysTick and the floating-point context.
 * Two independent emulators must record the same words. With SEMIHOSTING the words are printed at the end. */
#include "bare.h"

enum { A = 24, B = 25, C = 26, D = 27, WORDS = 256, PENDSV = 14, SYSTICK = 15 };

#define ICER(n) REG(0xE000E180U + 4U * (n))
#define ICPR(n) REG(0xE000E280U + 4U * (n))
#define IABR(n) REG(0xE000E300U + 4U * (n))
#define ICSR REG(0xE000ED04U)
#define AIRCR REG(0xE000ED0CU)
#define SHPR(vector) (*(volatile uint8_t *)(0xE000ED14U + (vector)))
#define STIR REG(0xE000EF00U)
#define SYST_CSR REG(0xE000E010U)
#define SYST_RVR REG(0xE000E014U)
#define SYST_CVR REG(0xE000E018U)
#define ALL (1U << A | 1U << B | 1U << C | 1U << D)
#define PENDSVSET (1U << 28)
#define PENDSTSET (1U << 26)
#define MARK(number) (0xC0DE0000U | (number))

volatile uint32_t out[WORDS], used, inner, again;
volatile float kept;

void reset(void);
void handler(void);

__attribute__((section(".vectors"), used)) const vector_t vectors[16 + 32] = {
    (vector_t)STACK_TOP, reset,
    [PENDSV] = handler,  [SYSTICK] = handler,
    [16 + A] = handler,  [16 + B] = handler,
    [16 + C] = handler,  [16 + D] = handler,
};

static void put(uint32_t word)
{
    if (used < WORDS) {
        out[used] = word;
        used = used + 1U;
    }
}

static void barrier(void)
{
    __asm__ volatile("dsb\n isb" ::: "memory");
}

static void mask(void)
{
    __asm__ volatile("cpsid i" ::: "memory");
}

static void unmask(void)
{
    __asm__ volatile("cpsie i\n isb" ::: "memory");
}

static void base_priority(uint32_t value)
{
    __asm__ volatile("msr basepri, %0\n isb" ::"r"(value) : "memory");
}

static uint32_t vector_now(void)
{
    uint32_t vector;
    __asm__ volatile("mrs %0, ipsr" : "=r"(vector));
    return vector;
}

/* Records its vector, and what is active and pending. Then it does what the step requests: it pends another interrupt
 * once (`inner`), or pends itself (`again`). */
void handler(void)
{
    const uint32_t vector = vector_now();
    put(vector);
    put(ICSR & 0x1FFU);
    put(IABR(0) & ALL);
    put(ISPR(0) & ALL);
    const uint32_t more = inner;
    inner = 0;
    if (more != 0U) {
        kept = kept * 2.0F;
        ISPR(0) = more;
        barrier();
        put(vector | 0x100U);
    }
    if (again != 0U) {
        again = again - 1U;
        ISPR(0) = 1U << (vector - 16U);
        barrier();
        put(vector | 0x200U);
    }
}

static void priorities(uint32_t a, uint32_t b, uint32_t c, uint32_t d)
{
    IPR(A) = (uint8_t)a;
    IPR(B) = (uint8_t)b;
    IPR(C) = (uint8_t)c;
    IPR(D) = (uint8_t)d;
}

static void all_at_once(uint32_t number, uint32_t a, uint32_t b, uint32_t c, uint32_t d)
{
    put(MARK(number));
    priorities(a, b, c, d);
    mask();
    ISPR(0) = ALL;
    barrier();
    put(ISPR(0) & ALL);
    unmask();
}

static void nested(uint32_t number, uint32_t first, uint32_t then)
{
    put(MARK(number));
    inner = 1U << then;
    ISPR(0) = 1U << first;
    barrier();
}

static void order(void)
{
    all_at_once(1, 0x40, 0x80, 0x20, 0x60); /* by priority */
    all_at_once(2, 0x40, 0x40, 0x40, 0x40); /* by number */
    priorities(0x80, 0x40, 0x80, 0xC0);
    nested(3, A, B); /* preempts */
    nested(4, A, C); /* waits: same priority */
    nested(5, A, D); /* waits: lower priority */
    put(MARK(6));
    again = 2;
    ISPR(0) = 1U << A; /* runs again after its return */
    barrier();
}

static void masks(void)
{
    put(MARK(7));
    base_priority(0x80);
    ISPR(0) = ALL;
    barrier();
    put(ISPR(0) & ALL); /* B alone has run */
    base_priority(0);
    put(ISPR(0) & ALL);
    put(MARK(8));
    mask();
    ISPR(0) = 1U << A;
    ICPR(0) = 1U << A;
    unmask(); /* nothing runs */
    put(MARK(9));
    ICER(0) = 1U << B;
    ISPR(0) = 1U << B;
    barrier();
    put(ISPR(0) & ALL);
    ISER(0) = 1U << B;
    barrier();
    put(MARK(10));
    STIR = C;
    barrier();
}

/* Priority groups of two bits: the bits below them order pending exceptions, but do not preempt. */
static void groups(void)
{
    put(MARK(11));
    AIRCR = 0x05FA0000U | 5U << 8;
    priorities(0x60, 0x40, 0x80, 0xC0);
    nested(12, A, B);
    mask();
    ISPR(0) = 1U << A | 1U << B;
    unmask();
    AIRCR = 0x05FA0000U;
    nested(13, A, B);
}

static void system_exceptions(void)
{
    put(MARK(14));
    priorities(0x80, 0x40, 0x80, 0xC0);
    SHPR(PENDSV) = 0xE0;
    SHPR(SYSTICK) = 0x20;
    mask();
    ICSR = PENDSVSET;
    ICSR = PENDSTSET;
    ISPR(0) = 1U << A;
    barrier();
    put(ICSR & (PENDSVSET | PENDSTSET));
    unmask();
    put(MARK(15));
    SYST_RVR = 99999U;
    SYST_CVR = 0;
    SYST_CSR = 5U; /* counts, without an interrupt */
    put(SYST_CSR & 7U);
    while ((SYST_CSR & 1U << 16) == 0U) {
    }
    put(SYST_CSR >> 16 & 1U); /* 0: the read in the loop has cleared it */
    SYST_CSR = 0;
}

/* Floating-point registers and flags must be preserved across a handler that uses them, too. */
static void context(void)
{
    float low = 1.5F, high = 2.5F;
    uint32_t sp_before, sp_after, flags;
    put(MARK(16));
    kept = 3.0F;
    __asm__ volatile("mov %0, sp" : "=r"(sp_before));
    __asm__ volatile("vcmp.f32 %0, %1" : "+t"(low), "+t"(high));
    inner = 1U << B;
    ISPR(0) = 1U << A;
    __asm__ volatile("dsb\n isb\n vmrs %2, fpscr" : "+t"(low), "+t"(high), "=r"(flags)::"memory");
    __asm__ volatile("mov %0, sp" : "=r"(sp_after));
    put(flags >> 28);
    put((uint32_t)(low * 4.0F + high * 4.0F));
    put((uint32_t)kept);
    put(sp_before - sp_after);
}

#ifdef SEMIHOSTING
static uint32_t call(uint32_t operation, const void *argument)
{
    register uint32_t r0 __asm__("r0") = operation;
    register const void *r1 __asm__("r1") = argument;
    __asm__ volatile("bkpt 0xAB" : "+r"(r0) : "r"(r1) : "memory");
    return r0;
}

static void print(uint32_t word)
{
    char text[10];
    for (int k = 0; k < 8; k++) {
        const uint32_t digit = word >> (28 - 4 * k) & 15U;
        text[k] = (char)(digit < 10U ? '0' + digit : 'a' + digit - 10U);
    }
    text[8] = '\n';
    text[9] = '\0';
    (void)call(4, text);
}

static void report(void)
{
    for (uint32_t k = 0; k < used; k++) {
        print(out[k]);
    }
    (void)call(0x18, (const void *)0x20026U); /* exits with status 0 */
}
#else
static void report(void)
{
}
#endif

__attribute__((used)) void reset(void)
{
#ifndef SEMIHOSTING
    watchdog_off();
#endif
    CPACR = 15U << 20;
    barrier();
    used = inner = again = 0;
    kept = 1.0F;
    ISER(0) = ALL;
    put(ISER(0) & ALL);
    order();
    masks();
    groups();
    system_exceptions();
    context();
    report();
    for (;;) {
    }
}
