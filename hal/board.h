/* SPDX-License-Identifier: Apache-2.0 */
#ifndef HAL_BOARD_H
#define HAL_BOARD_H
/** Digital lines of the inverter board: contactors, supplies, safe state, gate fault.
 * Source   docs/howto/port.md
 * Units    none: lines that are on or off
 * Errors   hal_board_gate_fault(): true while the gate driver reports a fault; the timer's fault input has already
 *          disabled switching
 * Context  1 kHz task */
#include <stdbool.h>

typedef enum {
    BOARD_PRECHARGE = 0,
    BOARD_MAIN_CONTACTOR = 1,
    BOARD_DISCHARGE = 2,
    BOARD_GATE_DRIVER = 3, /* supply of the gate driver; without it the bridge cannot switch */
    BOARD_SAFE_STATE = 4,  /* requests the hardware's safe state, independent of the processor */
    BOARD_OUTPUTS = 5
} board_output_t;

void hal_board_set(board_output_t output, bool on);
bool hal_board_gate_fault(void);

#endif
