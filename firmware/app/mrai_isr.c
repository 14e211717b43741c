/* SPDX-License-Identifier: Apache-2.0 */
#include "app/drive.h"

/* The 2014 paper's law, each period. */
static void identify_as_the_paper(drive_t *drive, const sample_t *sample)
{
    slow_state_t *slow = &drive->slow;
    const mrai_config_t *config = &drive->motor.mrai;
    const mrai_schedule_t *schedule = schedule_box_read(&drive->schedules);

    if (drive->request.identification_resets != slow->identification_resets) {
        slow->identification_resets = drive->request.identification_resets;
        slow->mrai = (mrai_state_t){0};
        mrai_reset(config, schedule, &slow->mrai, &sample->mrai); /* goes on from this sample, not from zero flux */
    } else if (sample->acting && !slow->mrai_asleep) {
        mrai_step(config, schedule, &slow->mrai, &sample->mrai);
    } else {
        /* The bridge was off: its voltage is not ours, only the currents are known. */
        mrai_reset(config, schedule, &slow->mrai, &sample->mrai);
    }
    slow->mrai_asleep = false;
    slow->psi_delta_q15 = fx_q15_from_q31(slow->mrai.psi_delta);
    (void)torque_estimate_step(&slow->torque, sample->mrai.i, &sample->mrai.flux, slow->mrai.psi_delta);
}

/* Sums only; the 1 kHz task does the rest and answers with the flux. */
static void collect(drive_t *drive, const sample_t *sample)
{
    slow_state_t *slow = &drive->slow;
    const identify_sample_t in = {
        .i = sample->mrai.i,
        .u = sample->mrai.u,
        .flux = &sample->mrai.flux,
        .theta = sample->theta_e,
        .acting = sample->acting,
        .limited = sample->snapped,
    };
    if (identify_window_step(&slow->window, &in)) {
        window_box_write(&drive->windows, &slow->window);
    }
    slow->mrai_asleep = true;
    slow->identification_resets = drive->request.identification_resets;
    slow->psi_delta_q15 = drive->task.identified.psi_delta;
}

void mrai_isr(drive_t *drive)
{
    const uint32_t asked = drive->fast.pended;
    const sample_t *sample = sample_box_look(&drive->samples);

    if (drive->request.identification_mode == IDENTIFICATION_ROBUST) {
        collect(drive, sample);
    } else {
        identify_as_the_paper(drive, sample);
    }
    drive->slow.finished = asked;
}
