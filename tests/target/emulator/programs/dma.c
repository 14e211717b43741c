/* SPDX-License-Identifier: Apache-2.0 */
/* Two linked channels of the DMA controller copy every second half word of a table, then every third one; the program
 * waits for the last of them. It does so twice: the second time the descriptors' DONE bits are set. */
#include "bare.h"

enum { COUNT = 40, RUNS = 2 };

#define FIELD(channel, at) REG(0x40009000U + 32U * (channel) + (at))
#define HALF_FIELD(channel, at) (*(volatile uint16_t *)(0x40009000U + 32U * (channel) + (at)))
#define CSR(channel) HALF_FIELD(channel, 0x1CU)
#define LINK_TO(channel) (0x20U | (channel) << 8)

volatile uint16_t table[3 * COUNT], copied[RUNS][2][COUNT];
volatile uint32_t finished;

void reset(void);
__attribute__((section(".vectors"), used)) const vector_t vectors[16] = {(vector_t)STACK_TOP, reset};

static void prepare(uint32_t channel, volatile uint16_t *to, uint32_t step)
{
    CSR(channel) = 0;
    FIELD(channel, 0x00U) = (uint32_t)table;
    HALF_FIELD(channel, 0x04U) = (uint16_t)(2U * step);
    HALF_FIELD(channel, 0x06U) = 0x0101U;
    FIELD(channel, 0x08U) = 2U * COUNT;
    FIELD(channel, 0x0CU) = 0;
    FIELD(channel, 0x10U) = (uint32_t)to;
    HALF_FIELD(channel, 0x14U) = 2U;
    HALF_FIELD(channel, 0x16U) = 1U;
    FIELD(channel, 0x18U) = 0;
    HALF_FIELD(channel, 0x1EU) = 1U;
}

__attribute__((used)) void reset(void)
{
    watchdog_off();
    finished = 0;
    for (uint32_t run = 0; run < RUNS; run++) {
        for (uint32_t k = 0; k < 3U * COUNT; k++) {
            table[k] = (uint16_t)(1000U * run + k);
        }
        prepare(0, copied[run][0], 2);
        prepare(1, copied[run][1], 3);
        CSR(0) = LINK_TO(1U) | 1U;
        while ((CSR(1) & 0x80U) == 0U) {
        }
        finished++;
    }
    for (;;) {
    }
}
