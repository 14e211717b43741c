/* SPDX-License-Identifier: Apache-2.0 */
#include "hal/board.h"

/* Write: set the pin of this output. After a reset all outputs must be off until this is called. */
void hal_board_set(board_output_t output, bool on)
{
    (void)output;
    (void)on;
}

/* Write: true if the gate driver has reported a fault since the last call, however short it was. */
bool hal_board_gate_fault(void)
{
    return false;
}
