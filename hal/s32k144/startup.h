/* SPDX-License-Identifier: Apache-2.0 */
#ifndef HAL_S32K144_STARTUP_H
#define HAL_S32K144_STARTUP_H
/** From reset to main(), and the reset after a fatal error.
 * Source   README.md, memory and stack guard
 * Units    bytes
 * Errors   panic(): switches the outputs off and resets the processor; every fault of the core ends there, and so does
 *          await() after 50 ms without the awaited value
 * Context  stack_measure(): background, reads every word; panic(): any, needs no stack */
#include <stdint.h>

/** Bytes of the stack that were never used; hal_system_stack_unused() returns the last result. */
uint32_t stack_measure(void);
_Noreturn void panic(void);

/** Waits until (*word & mask) == value. */
void await(const volatile uint32_t *word, uint32_t mask, uint32_t value);

/* Handlers named by the vector table. */
void reset_handler(void);
void start_up(void); /* second part of the reset handler */
void fault_handler(void);
void gate_fault_handler(void);
void adc_handler(void);
void sampling_error_handler(void);
void mrai_handler(void);
void can_message_handler(void);
void can_bus_off_handler(void);
void tick_handler(void);

#endif
