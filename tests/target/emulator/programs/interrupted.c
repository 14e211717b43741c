/* SPDX-License-Identifier: Apache-2.0 */
/* IT blocks with every condition and different flags, loads and stores of several registers, to be interrupted at each
 * instruction by a handler that changes the flags in an IT block of its own. All registers and memory make the sum. */
#include "bare.h"

enum { IRQ = 10, BLOCK_WORDS = 8 };

volatile uint32_t sum, done, interrupts, from; /* from: where the last interrupt came */
uint32_t block[BLOCK_WORDS];

void reset(void);
void handler(void);

__attribute__((section(".vectors"), used))
const vector_t vectors[16 + 64] = {(vector_t)STACK_TOP, reset, [16 + IRQ] = handler};

__attribute__((naked)) void handler(void)
{
    __asm__ volatile("ldr r1, [sp, #24]\n"
                     "ldr r2, =from\n"
                     "str r1, [r2]\n"
                     "ldr r2, =interrupts\n"
                     "ldr r3, [r2]\n"
                     "cmp r3, #0\n"
                     "ite eq\n"
                     "addeq r3, #1\n"
                     "addne r3, #2\n"
                     "str r3, [r2]\n"
                     "adds r1, r3, r3\n"
                     "movs r12, #0\n"
                     "bx lr\n"
                     ".ltorg");
}

/* Flags of a - b; then a block of four with the condition and its opposite, with loads and stores. */
#define CASE(condition, opposite) \
    static uint32_t case_##condition(uint32_t a, uint32_t b) \
    { \
        register uint32_t *at __asm__("r0") = block; \
        register uint32_t x __asm__("r1") = 1, y __asm__("r2") = 2, z __asm__("r3") = 3; \
        uint32_t flags; \
        __asm__ volatile("cmp %5, %6\n" \
                         "itete " #condition "\n" \
                         "add" #condition " %0, %0, #16\n" \
                         "ldr" #opposite " %1, [%4], #4\n" \
                         "str" #condition " %0, [%4, #8]!\n" \
                         "stm" #opposite " %4!, {%0, %2}\n" \
                         "it " #condition "\n" \
                         "mov" #condition " %2, #77\n" \
                         "adds %2, %2, %1, lsl #3\n" \
                         "it " #condition "\n" \
                         "cmp" #condition " %0, %1\n" /* flags that the next block depends on */ \
                         "itt " #condition "\n" \
                         "ldm" #condition " %4, {%1, %2}\n" \
                         "add" #condition " %0, %1\n" \
                         "mrs %3, apsr\n" \
                         : "+r"(x), "+r"(y), "+r"(z), "=r"(flags), "+r"(at) \
                         : "r"(a), "r"(b) \
                         : "cc", "memory"); \
        return x + 3U * y + 5U * z + (flags >> 28) + (uint32_t)(uintptr_t)at; \
    }

CASE(eq, ne)
CASE(ne, eq)
CASE(cs, cc)
CASE(cc, cs)
CASE(mi, pl)
CASE(pl, mi)
CASE(vs, vc)
CASE(vc, vs)
CASE(hi, ls)
CASE(ls, hi)
CASE(ge, lt)
CASE(lt, ge)
CASE(gt, le)
CASE(le, gt)

typedef uint32_t (*case_t)(uint32_t a, uint32_t b);

static const case_t cases[] = {case_eq, case_ne, case_cs, case_cc, case_mi, case_pl, case_vs,
                               case_vc, case_hi, case_ls, case_ge, case_lt, case_gt, case_le};
static const uint32_t operands[][2] = {{5, 5}, {3, 9}, {9, 3}, {0x80000000U, 1}, {1, 0x80000000U}};

__attribute__((used)) void reset(void)
{
    watchdog_off();
    sum = done = interrupts = 0;
    ISER(0) = 1U << IRQ;
    for (uint32_t k = 0; k < sizeof cases / sizeof cases[0]; k++) {
        for (uint32_t n = 0; n < sizeof operands / sizeof operands[0]; n++) {
            for (uint32_t i = 0; i < BLOCK_WORDS; i++) {
                block[i] = 100U * k + 10U * n + i;
            }
            uint32_t total = cases[k](operands[n][0], operands[n][1]);
            for (uint32_t i = 0; i < BLOCK_WORDS; i++) {
                total = 31U * total + block[i];
            }
            sum = 33U * sum + total;
        }
    }
    done = 1;
    for (;;) {
    }
}
