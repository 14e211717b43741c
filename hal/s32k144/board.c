/* SPDX-License-Identifier: Apache-2.0 */
#include "hal/board.h"

#include "hal/s32k144/pins.h"
#include "hal/s32k144/pwm.h"
#include "hal/s32k144/registers.h"

static const uint8_t line[BOARD_OUTPUTS] = {
    [BOARD_PRECHARGE] = PIN_PRECHARGE,
    [BOARD_MAIN_CONTACTOR] = PIN_MAIN_CONTACTOR,
    [BOARD_DISCHARGE] = PIN_DISCHARGE,
    [BOARD_GATE_DRIVER] = PIN_GATE_DRIVER,
};

void hal_board_set(board_output_t output, bool on)
{
    if ((unsigned)output >= (unsigned)BOARD_OUTPUTS) {
        return;
    }
    if (output == BOARD_SAFE_STATE) {
        pins_keep_bridge(!on);
    } else if (on) {
        PTC->PSOR = 1U << line[output];
    } else {
        PTC->PCOR = 1U << line[output];
    }
}

bool hal_board_gate_fault(void)
{
    return pwm_fault_reported();
}
