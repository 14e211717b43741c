/* SPDX-License-Identifier: Apache-2.0 */
/* Loads from and stores to each memory in an IT block. What follows the block is not conditional: it adds 7 to the sum
 * although the flags have changed. */
#include "bare.h"

enum { PLACES = 4 };

volatile uint32_t sum[PLACES]; /* of each place */

void reset(void);

__attribute__((section(".vectors"), used)) const vector_t vectors[16] = {(vector_t)STACK_TOP, reset};

static uint32_t access(volatile uint32_t *at, uint32_t store)
{
    uint32_t total = 0, value = *at;
    __asm__ volatile("cmp %3, #1\n"
                     "ite eq\n"
                     "streq %1, [%2]\n"
                     "ldrne %1, [%2]\n"
                     "eor %3, #1\n"
                     "cmp %3, #1\n" /* the opposite */
                     "b 1f\n"
                     "1: add %0, #1\n"
                     "add %0, #2\n"
                     "add %0, #4\n"
                     : "+r"(total), "+r"(value), "+r"(at), "+r"(store)
                     :
                     : "cc", "memory");
    return total;
}

__attribute__((used)) void reset(void)
{
    watchdog_off();
    volatile uint32_t *const place[PLACES] = {&REG(0x1FFF9000U), &REG(0x20000800U), &WDOG_TOVAL, &REG(0x410U)};
    for (uint32_t k = 0; k < PLACES; k++) {
        const uint32_t writable = k < 2U ? 1U : 0U;
        sum[k] = access(place[k], 0) + 16U * access(place[k], writable);
    }
    for (;;) {
    }
}
