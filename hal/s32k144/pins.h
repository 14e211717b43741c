/* SPDX-License-Identifier: Apache-2.0 */
#ifndef HAL_S32K144_PINS_H
#define HAL_S32K144_PINS_H
/** Which pin does what. GPIO lines are all on port C.
 * Source   README.md, pins
 * Context  start-up, once, before the timers start */

enum {
    PIN_PRECHARGE = 0,
    PIN_MAIN_CONTACTOR = 1,
    PIN_DISCHARGE = 2,
    PIN_GATE_DRIVER = 3,
    PIN_SAFE_STATE = 6,
    PIN_RESOLVER_A0 = 8,
    PIN_RESOLVER_A1 = 9
};

void pins_init(void);

#endif
