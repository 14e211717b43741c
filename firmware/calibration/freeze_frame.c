/* SPDX-License-Identifier: Apache-2.0 */
#include "calibration/freeze_frame.h"

#define LIMIT(x) (((x) > 32767) ? 32767 : ((x) < -32767) ? -32767 : (x))
#define KEEP(name, base, text) frame->name[frame->oldest] = (int16_t)LIMIT(now->name);

bool freeze_frame_step(freeze_frame_t *frame, const measurements_t *now, uint16_t ecu_faults, uint8_t state,
                       uint32_t passed_ms)
{
    const bool fault = now->fault_word != 0U || ecu_faults != 0U;
    frame->now_ms += passed_ms;
    if (frame->frozen != 0U) {
        frame->frozen = fault ? 1U : 0U;
        return !fault;
    }
    FREEZE_FRAME_LIST(KEEP)
    frame->oldest = (uint8_t)((frame->oldest + 1U) % FREEZE_FRAME_SAMPLES);
    if (!fault) {
        frame->state = state;
        return false;
    }
    frame->frozen = 1U;
    frame->time_ms = frame->now_ms;
    frame->fault_word = now->fault_word;
    frame->motor_check = now->motor_check;
    frame->ecu_faults = ecu_faults;
    frame->psi_f_Vs = now->psi_f_Vs;
    frame->r_ohm = now->r_ohm;
    return true;
}
