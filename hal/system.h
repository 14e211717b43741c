/* SPDX-License-Identifier: Apache-2.0 */
#ifndef HAL_SYSTEM_H
#define HAL_SYSTEM_H
/** What the processor knows about itself.
 *   stack_unused  bytes at the stack's end that still hold the pattern written at start-up: the high-water mark
 *   reset_cause   why the processor started; noted by the port before it clears the register
 * Source   docs/howto/port.md
 * Units    bytes
 * Errors   a port that cannot tell answers 0 and RESET_UNKNOWN
 * Context  1 kHz task; stack_unused may look at a bounded number of words per call */
#include <stdint.h>

typedef enum {
    RESET_UNKNOWN = 0,
    RESET_POWER_ON = 1,
    RESET_PIN = 2,
    RESET_WATCHDOG = 3,
    RESET_SOFTWARE = 4,
    RESET_BROWN_OUT = 5,
    RESET_LOCKUP = 6,
    RESET_CLOCK = 7
} reset_cause_t;

uint32_t hal_system_stack_unused(void);
reset_cause_t hal_system_reset_cause(void);

#endif
