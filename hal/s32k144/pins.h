/* SPDX-License-Identifier: Apache-2.0 */
#ifndef HAL_S32K144_PINS_H
#define HAL_S32K144_PINS_H
/** Which pin does what. GPIO lines are all on port C, the encoder's index is on port D.
 * Source   README.md, pins
 * Context  start-up, before the timers start */
#include <stdbool.h>

enum {
    PIN_PRECHARGE = 0,
    PIN_MAIN_CONTACTOR = 1,
    PIN_DISCHARGE = 2,
    PIN_GATE_DRIVER = 3,
    PIN_SAFE_STATE = 6,
    PIN_RESOLVER_A0 = 8,
    PIN_RESOLVER_A1 = 9,
    PIN_INDEX = 12
};

/** All lines off except that of the safe state, which stays released: the board's hardware controls the bridge. */
void pins_init(void);
/** The PWM is set up: from here on the line may be driven low. */
void pins_offer_bridge(void);
/** Drives the line low, so that the processor controls the bridge, or releases it; without an effect before
 * pins_offer_bridge(). Start-up, 1 kHz task. */
void pins_keep_bridge(bool keep);

#endif
