/* SPDX-License-Identifier: Apache-2.0 */
#ifndef HAL_SHUT_OFF_H
#define HAL_SHUT_OFF_H
/** The external watchdog, which asks questions and switches off the gate supply after wrong, early, late or missing
 * answers, and the read-back of this supply.
 *   question()  the present question, 0 ... 15, never the same twice in a row; false: no such device is fitted
 *   answer()    to the present question; a right one brings the next question
 *   supply()    whether the gate drivers have supply, read back behind all its switches; true within 10 ms of a request
 * Source   docs/howto/port.md; docs/theory/third-level.md
 * Units    none: a question, an answer of 32 bits
 * Range    questions 0 ... 15
 * Errors   none; a device that does not respond any more must not return false but its last question
 * Context  1 kHz task: question() at the start of each step, answer() once at its end */
#include <stdbool.h>
#include <stdint.h>

bool hal_shut_off_question(uint8_t *question);
void hal_shut_off_answer(uint32_t answer);
bool hal_shut_off_supply(void);

#endif
