/* SPDX-License-Identifier: Apache-2.0 */
#include "drive/mrai/mrai_seam.h"
#include "drive/mrai/schedule_box.h"
#include "fx/codegen.h"

/* After a reset the parameters are zero. */
static FX_NOT_INLINED FX_COLD void reset_if_requested(drive_t *drive)
{
    mrai_isr_state_t *state = &drive->mrai.isr;
    if (drive->request.identification_resets != state->identification_resets) {
        state->identification_resets = drive->request.identification_resets;
        state->law = (mrai_state_t){0};
    }
}

/* One PWM period of the paper's law: parameters, then torque. If the bridge was off, so that the acting voltage is
 * unknown, or the previous point was dropped, or after a reset, the observer starts from the measured currents. */
void mrai_isr(drive_t *drive)
{
    const uint32_t generation = drive->mrai.mailbox.generation;
    const sample_t *sample = sample_box_at(&drive->samples, generation);
    const operating_point_t *point = &sample->point;
    mrai_isr_state_t *state = &drive->mrai.isr;
    const mrai_schedule_t *schedule = schedule_box_read(&drive->mrai.schedules);

    const bool starts = !sample->acting || generation - state->finished != 1U ||
                        drive->request.identification_resets != state->identification_resets;
    if (starts) {
        reset_if_requested(drive);
        mrai_start_before_step(&state->law);
    }
    mrai_step(&drive->mrai_parameters, schedule, &state->law, point);
    if (starts) {
        mrai_start_after_step(&state->law);
    }
    const int32_t psi_delta = mrai_psi_delta_q15(&state->law);
    drive->psi_d_error = (q15_t)psi_delta;
    torque_estimate_add(&state->torque, &point->i, &point->flux, psi_delta);
    exchange_barrier();
    state->finished = generation;
}
