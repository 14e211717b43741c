/* SPDX-License-Identifier: Apache-2.0 */
#include "drive/mrai/mrai_seam.h"
#include "drive/mrai/schedule_box.h"

void mrai_snapshot(const drive_t *drive, snapshot_t *snapshot)
{
    snapshot->mrai.law = drive->mrai.isr.law;
    snapshot->mrai.torque = drive->mrai.isr.torque;
}

void mrai_identify(drive_t *drive, const snapshot_t *snapshot)
{
    const mrai_config_t *config = &drive->mrai_parameters;
    const mrai_state_t *law = &snapshot->mrai.law;
    mrai_task_state_t *task = &drive->mrai.task;
    drive->task.identification = (identification_t){
        .psi_delta = law->psi_delta,
        .r_delta = law->r_delta,
        .lq_error = 0,                  /* not identified: the psi_q of the tables holds */
        .iron_admittance = 0,           /* not part of this law */
        .torque_variance_q30 = Q31_MAX, /* not stated by this law: the loop may use all of its authority */
        .psi_d_error = snapshot->psi_d_error,
        .torque_estimated = torque_estimate_mean(&task->torque_mean, &snapshot->mrai.torque),
        .confidence = Q15_MAX,
        .psi_quality = task->quality.psi_quality,
        .r_quality = task->quality.r_quality,
        .psi_clamped = mrai_flux_clamped(config, law),
        .r_clamped = mrai_resistance_clamped(config, law),
    };
}

void mrai_reschedule(drive_t *drive, const snapshot_t *snapshot, const operating_point_t *commanded)
{
    const mrai_schedule_in_t in = {
        .sample = &snapshot->sample.point,
        .next = commanded,
        .identifier = &snapshot->mrai.law,
        .enabled = drive->request.identification && snapshot->sample.acting,
    };
    mrai_quality_t *quality = &drive->mrai.task.quality;
    schedule_box_write(&drive->mrai.schedules, mrai_schedule_step(&drive->mrai_parameters, quality, &in));
    drive->task.identification.psi_quality = quality->psi_quality;
    drive->task.identification.r_quality = quality->r_quality;
}

/* The interrupt resets its own part at its next point. */
void mrai_discard(drive_t *drive)
{
    drive->mrai.task.quality = (mrai_quality_t){0};
}

bool mrai_is_stalled(drive_t *drive)
{
    const uint32_t finished = drive->mrai.isr.finished;
    uint32_t *seen = &drive->mrai.task.finished_seen;
    const bool stalled = drive->mrai.mailbox.generation != finished && *seen == finished;
    *seen = finished;
    return stalled;
}
