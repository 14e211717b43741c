/* SPDX-License-Identifier: Apache-2.0 */
#include "drive/mrai/mrai_seam.h"
#include "drive/mrai/schedule_box.h"
#include "fx/codegen.h"

/* If the bridge was off, so that the acting voltage is unknown, or the previous point was dropped, the observer
 * restarts from the measured currents and keeps the identified parameters. After a reset it restarts with parameters of
 * zero. */
static FX_NOT_INLINED FX_COLD void restart(drive_t *drive, const mrai_schedule_t *schedule)
{
    mrai_isr_state_t *state = &drive->mrai.isr;
    if (drive->request.identification_resets != state->identification_resets) {
        state->identification_resets = drive->request.identification_resets;
        state->law = (mrai_state_t){0};
    }
    mrai_reset(&drive->mrai_parameters, schedule, &state->law, &drive->mrai.mailbox.point);
}

/* One PWM period of the paper's law: parameters, then torque. */
void mrai_isr(drive_t *drive)
{
    const mrai_mailbox_t *mailbox = &drive->mrai.mailbox;
    const operating_point_t *point = &mailbox->point;
    const uint32_t generation = mailbox->generation;
    mrai_isr_state_t *state = &drive->mrai.isr;
    const mrai_schedule_t *schedule = schedule_box_read(&drive->mrai.schedules);

    if (!mailbox->acting || generation - state->finished != 1U ||
        drive->request.identification_resets != state->identification_resets) {
        restart(drive, schedule);
    } else {
        mrai_step(&drive->mrai_parameters, schedule, &state->law, point);
    }
    const int32_t psi_delta = mrai_psi_delta_q15(&state->law);
    drive->psi_d_error = (q15_t)psi_delta;
    torque_estimate_add(&state->torque, &point->i, &point->flux, psi_delta);
    exchange_barrier();
    state->finished = generation;
}
