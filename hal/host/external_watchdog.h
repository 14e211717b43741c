/* SPDX-License-Identifier: Apache-2.0 */
#ifndef HAL_HOST_EXTERNAL_WATCHDOG_H
#define HAL_HOST_EXTERNAL_WATCHDOG_H
/** Simulated external watchdog with questions and answers, and the gate supply that it switches.
 *   A wrong answer, an answer less than 0.4 ms after the last one, and 3 ms without an answer each increment an error
 *   counter; a right answer decrements it. The supply is off from 3 errors on until the counter is 0 again, and before
 *   the first right answer.
 * Source   docs/theory/third-level.md, from which the expected answers were written anew
 * Units    us of simulated time
 * Context  hal/host */
#include <stdbool.h>
#include <stdint.h>

typedef struct {
    bool switched_on; /* the supply, by the device */
    uint8_t question, errors;
    double since_us;           /* the last answer, or the last error */
    bool does_not_switch_off;  /* defective */
    bool supply_does_not_stop; /* the switch of the board is defective */
} external_watchdog_t;

void external_watchdog_start(external_watchdog_t *device);
void external_watchdog_pass(external_watchdog_t *device, double us);
void external_watchdog_answer(external_watchdog_t *device, uint32_t answer);
/** The gate drivers have supply if the board's switch is on. */
bool external_watchdog_supply(const external_watchdog_t *device, bool board_on);

#endif
