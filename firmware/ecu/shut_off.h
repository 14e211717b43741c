/* SPDX-License-Identifier: Apache-2.0 */
#ifndef ECU_SHUT_OFF_H
#define ECU_SHUT_OFF_H
/** The paths that can shut off the torque: their test after start-up, and the gate supply while it is needed.
 *   During the test switching is disabled, and this must be read back. The gate supply must follow first its switch and
 *   then the external watchdog, which is given wrong answers. A path that fails stays failed until the next start.
 *   While the state machine requires the supply, it must be present.
 * Source   docs/theory/third-level.md
 * Units    us of true time
 * Range    every combination of inputs
 * Errors   a bit of ecu_fault_t in faults
 * Context  1 kHz task; pure */
#include <stdbool.h>
#include <stdint.h>

typedef struct {
    bool fitted;    /* there is an external watchdog: without it nothing is tested */
    bool supply;    /* read back */
    bool switching; /* read back */
    bool wanted;    /* the state machine requires the gate supply */
    bool idle;      /* contactor and precharge are off */
    uint32_t elapsed_us;
} shut_off_in_t;

typedef struct {
    uint8_t stage;
    bool tested;     /* every path works, or there is none to be tested */
    bool supply_on;  /* the test requires the gate supply */
    bool wrong;      /* the test requires a wrong answer */
    uint16_t failed; /* in the test */
    uint16_t faults; /* of this step */
    uint32_t us;     /* in the present stage, or for which the supply has been absent */
} shut_off_t;

void shut_off_step(shut_off_t *state, const shut_off_in_t *in);

#endif
