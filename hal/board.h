/* SPDX-License-Identifier: Apache-2.0 */
#ifndef HAL_BOARD_H
#define HAL_BOARD_H
/** Lines of the inverter that are neither PWM nor measurement.
 * Source   docs/howto/port.md
 * Errors   hal_board_gate_fault(): true while the gate driver reports a fault; the timer's fault input has already
 *          opened the gates by then
 * Context  1 kHz task */
#include <stdbool.h>

typedef enum {
    BOARD_PRECHARGE = 0,
    BOARD_MAIN_CONTACTOR = 1,
    BOARD_DISCHARGE = 2,
    BOARD_GATE_DRIVER = 3, /* supplies the gate driver; off, no gate can close */
    BOARD_SAFE_STATE = 4,  /* asks the hardware for its safe state, whatever the processor does next */
    BOARD_OUTPUTS = 5
} board_output_t;

void hal_board_set(board_output_t output, bool on);
bool hal_board_gate_fault(void);

#endif
