/* SPDX-License-Identifier: Apache-2.0 */
/* One fault of the core, chosen by CASE, and what its handler sees. */
#include "bare.h"

enum { SEEN_VECTOR, SEEN_PC, SEEN_CFSR, SEEN_HFSR, SEEN_BFAR, SEEN_WORDS };

#define SHCSR REG(0xE000ED24U)
#define CFSR REG(0xE000ED28U)
#define HFSR REG(0xE000ED2CU)
#define BFAR REG(0xE000ED38U)
#define RAM 0x1FFF8000U
#define ALL_FAULTS (7U << 16)

#ifndef SHCSR_BITS
#define SHCSR_BITS 0U
#endif
#ifndef BEFORE
#define BEFORE "" /* an instruction */
#endif
#ifndef AGAIN
#define AGAIN 0 /* a second fault, within the handler */
#endif

volatile uint32_t seen[SEEN_WORDS], entries, after, cleared;

void reset(void);
void handler(void);
void record(const uint32_t *frame);

__attribute__((section(".vectors"), used)) const vector_t vectors[16] = {
    (vector_t)STACK_TOP, reset, handler, handler, handler, handler, handler,
};

__attribute__((used)) void record(const uint32_t *frame)
{
    uint32_t vector;
    __asm__ volatile("mrs %0, ipsr" : "=r"(vector));
    seen[SEEN_VECTOR] = vector;
    seen[SEEN_PC] = (uintptr_t)frame >= RAM ? frame[6] : 0U;
    seen[SEEN_CFSR] = CFSR;
    seen[SEEN_HFSR] = HFSR;
    seen[SEEN_BFAR] = BFAR;
    CFSR = seen[SEEN_CFSR];
    HFSR = seen[SEEN_HFSR];
    cleared = CFSR | HFSR;
    entries = entries + 1U;
#if AGAIN
    __asm__ volatile("udf #1");
#endif
    for (;;) {
    }
}

__attribute__((naked)) void handler(void)
{
    __asm__ volatile("mov r0, sp\n ldr sp, =0x20000800\n b record");
}

#if CASE == 0 /* read where there is no memory */
#define FAULT "ldr r0, =0x60000000\n at_fault: ldr r0, [r0]\n"
#elif CASE == 1 /* write of the flash */
#define FAULT "ldr r0, =0x00008000\n at_fault: str r0, [r0]\n"
#elif CASE == 2 /* FTM0 without its clock */
#define FAULT "ldr r0, =0x40038008\n at_fault: str r0, [r0]\n"
#elif CASE == 3 /* the same, read */
#define FAULT "ldr r0, =0x40038008\n at_fault: ldr r0, [r0]\n"
#elif CASE == 4 /* fetch from the peripherals */
#define FAULT "ldr r0, =0x40038001\n bx r0\n at_fault:\n"
#elif CASE == 5 /* fetch where there is no memory */
#define FAULT "ldr r0, =0x1FFF0001\n bx r0\n at_fault:\n"
#elif CASE == 6
#define FAULT "at_fault: udf #0\n"
#elif CASE == 7 /* Arm state: a branch to an even address */
#define FAULT "ldr r0, =target\n bic r0, #1\n at_fault: bx r0\n .align 2\n target: nop\n"
#elif CASE == 8 /* the stack ends below the RAM */
#define FAULT "ldr r0, =0x1FFF8000\n mov sp, r0\n at_fault: push {r0}\n"
#endif

__attribute__((used)) void reset(void)
{
    watchdog_off();
    entries = after = 0;
    cleared = 1;
    SHCSR = SHCSR_BITS;
    __asm__ volatile(".global at_fault\n" BEFORE "\n" FAULT " nop\n" ::: "r0", "memory");
    after = 1;
    for (;;) {
    }
}
