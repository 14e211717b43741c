/* SPDX-License-Identifier: Apache-2.0 */
/* The DMA controller, chosen by CASE. 0: two linked channels copy every second half word of a table, then every third
 * one, and the program waits for the last of them; the second time the descriptors' DONE bits are set. 1: two fields of
 * a descriptor are written at once. 2: a function in RAM is replaced by a copy. */
#include "bare.h"

enum { COUNT = 40, RUNS = 2 };

#define FIELD(channel, at) REG(0x40009000U + 32U * (channel) + (at))
#define HALF_FIELD(channel, at) (*(volatile uint16_t *)(0x40009000U + 32U * (channel) + (at)))
#define CSR(channel) HALF_FIELD(channel, 0x1CU)
#define LINK_TO(channel) (0x20U | (channel) << 8)

void reset(void);
__attribute__((section(".vectors"), used)) const vector_t vectors[16] = {(vector_t)STACK_TOP, reset};

static inline void prepare(uint32_t channel, volatile void *from, volatile void *to, uint32_t step, uint32_t count)
{
    CSR(channel) = 0;
    FIELD(channel, 0x00U) = (uint32_t)from;
    HALF_FIELD(channel, 0x04U) = (uint16_t)(2U * step);
    HALF_FIELD(channel, 0x06U) = 0x0101U;
    FIELD(channel, 0x08U) = 2U * count;
    FIELD(channel, 0x0CU) = 0;
    FIELD(channel, 0x10U) = (uint32_t)to;
    HALF_FIELD(channel, 0x14U) = 2U;
    HALF_FIELD(channel, 0x16U) = 1U;
    FIELD(channel, 0x18U) = 0;
    HALF_FIELD(channel, 0x1EU) = 1U;
}

static inline void wait_for(uint32_t channel)
{
    while ((CSR(channel) & 0x80U) == 0U) {
    }
}

#if CASE == 0
volatile uint16_t table[3 * COUNT], copied[RUNS][2][COUNT];
volatile uint32_t finished;

static void run(void)
{
    finished = 0;
    for (uint32_t run = 0; run < RUNS; run++) {
        for (uint32_t k = 0; k < 3U * COUNT; k++) {
            table[k] = (uint16_t)(1000U * run + k);
        }
        prepare(0, table, copied[run][0], 2, COUNT);
        prepare(1, table, copied[run][1], 3, COUNT);
        CSR(0) = LINK_TO(1U) | 1U;
        wait_for(1);
        finished++;
    }
}
#elif CASE == 1
static void run(void)
{
    FIELD(0, 0x1CU) = 1U << 16;
}
#else
/* movs r0, #1 or movs r0, #2; then two narrow instructions or a wide one, which do nothing; then a return. */
static const uint16_t narrow[5] = {0x2001, 0xBF00, 0xBF00, 0x4770, 0x4770};
static const uint16_t wide[5] = {0x2002, 0xF3AF, 0x8000, 0x4770, 0x4770};
volatile uint16_t code[5];
volatile uint32_t answer[RUNS], cycles[RUNS];

static inline void call(uint32_t k)
{
    uint32_t (*const function)(void) = (uint32_t (*)(void))((uint32_t)code | 1U);
    for (uint32_t again = 0; again < 2U; again++) {
        const uint32_t before = REG(0xE0001004U);
        answer[k] = function();
        cycles[k] = REG(0xE0001004U) - before;
    }
}

static void run(void)
{
    REG(0xE000EDFCU) = 1U << 24;
    REG(0xE0001000U) = 1;
    for (uint32_t k = 0; k < RUNS; k++) {
        prepare(0, (volatile void *)(uint32_t)(k == 0U ? narrow : wide), code, 1, 5);
        CSR(0) = 1;
        wait_for(0);
        call(k);
    }
}
#endif

__attribute__((used)) void reset(void)
{
    watchdog_off();
    run();
    for (;;) {
    }
}
