/* SPDX-License-Identifier: Apache-2.0 */
#ifndef HAL_SYSTEM_H
#define HAL_SYSTEM_H
/** Stack use and reset cause of the processor.
 *   stack_unused  bytes at the stack's end that still hold the pattern written at start-up: the high-water mark
 *   reset_cause   why the processor started; noted by the port before it clears the register
 * Source   docs/howto/port.md
 * Units    bytes
 * Range    0 ... size of the stack; RESET_CAUSE_LIST
 * Errors   a port without this information returns 0 and RESET_UNKNOWN
 * Context  1 kHz task; stack_unused may check a bounded number of words per call */
#include <stdint.h>

/* X(NAME, value, explanation): named and explained here only. */
#define RESET_CAUSE_LIST(X) \
    X(UNKNOWN, 0, "The port cannot tell.") \
    X(POWER_ON, 1, "The supply was switched on.") \
    X(PIN, 2, "The reset pin.") \
    X(WATCHDOG, 3, "The watchdog was not served, or too early.") \
    X(SOFTWARE, 4, "The firmware itself.") \
    X(BROWN_OUT, 5, "The supply voltage was too low.") \
    X(LOCKUP, 6, "The core locked up.") \
    X(CLOCK, 7, "The clock was lost.")

#define RESET_VALUE(name, value, text) RESET_##name = (value),
typedef enum { RESET_CAUSE_LIST(RESET_VALUE) } reset_cause_t;
#undef RESET_VALUE

uint32_t hal_system_stack_unused(void);
reset_cause_t hal_system_reset_cause(void);

#endif
