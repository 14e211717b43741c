/* SPDX-License-Identifier: Apache-2.0 */
#ifndef HAL_MPS2_SEMIHOSTING_H
#define HAL_MPS2_SEMIHOSTING_H
/** Output to the emulator that runs the image, and the end of the run.
 * Source   Arm semihosting specification: SYS_WRITE0, SYS_EXIT_EXTENDED
 * Context  any; without a debugger or emulator each call is a fault */
#include <stdint.h>

void semihosting_print(const char *text);
/** name=value in hexadecimal, and a new line. */
void semihosting_print_word(const char *name, uint32_t value);
_Noreturn void semihosting_exit(uint32_t status);

#endif
