/* SPDX-License-Identifier: Apache-2.0 */
#include "hal/mps2/semihosting.h"

#define SYS_WRITE0 0x04U
#define SYS_EXIT_EXTENDED 0x20U
#define APPLICATION_EXIT 0x20026U

static void call(uint32_t operation, const void *argument)
{
    register uint32_t r0 __asm__("r0") = operation;
    register const void *r1 __asm__("r1") = argument;
    __asm__ volatile("bkpt 0xAB" : "+r"(r0) : "r"(r1) : "memory");
}

void semihosting_print(const char *text)
{
    call(SYS_WRITE0, text);
}

void semihosting_print_word(const char *name, uint32_t value)
{
    char text[] = "=00000000\n";
    for (uint32_t k = 0; k < 8U; k++) {
        text[8U - k] = "0123456789abcdef"[(value >> (4U * k)) & 15U];
    }
    semihosting_print(name);
    semihosting_print(text);
}

_Noreturn void semihosting_exit(uint32_t status)
{
    const uint32_t block[2] = {APPLICATION_EXIT, status};
    call(SYS_EXIT_EXTENDED, block);
    for (;;) {
    }
}
