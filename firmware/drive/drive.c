/* SPDX-License-Identifier: Apache-2.0 */
#include "drive/mrai/mrai_seam.h"

void drive_init(drive_t *drive, const motor_t *source)
{
    *drive = (drive_t){.motor = source,
                       .period = {source->measure, source->angle_tracker, source->monitor, source->flux_table,
                                  source->bases.periods_per_step},
                       .parameters = source->parameters,
                       .request = {.torque_loop = true,
                                   .identification = true,
                                   .trim = true,
                                   .identification_mode = IDENTIFICATION_ROBUST,
                                   .limits = TORQUE_LIMITS_NONE},
                       .fast.step_end = source->bases.periods_per_step,
                       .task.reference = current_reference_start(source->torque_max)};
    mrai_init(drive);
    identify_reset(&drive->motor->identify, &drive->task.identify);
    data_check_start(drive);
    drive_refuse(drive, motor_check(source));
}

void drive_raise_fault(drive_t *drive, uint32_t fault)
{
    if (drive->fast.faults == 0U) {
        drive->fast.fault_period = drive->samples.generation + 1U; /* of the period whose sample is being made */
    }
    drive->fast.faults = drive->fast.faults | fault;
    drive->fast.is_settled = false;
}

void drive_refuse(drive_t *drive, motor_check_t check)
{
    if (check != MOTOR_CHECK_OK) {
        if (drive->fast.motor_check == MOTOR_CHECK_OK) {
            drive->fast.motor_check = (uint8_t)check;
        }
        drive_raise_fault(drive, FAULT_CONFIG);
    }
}

progress_t drive_progress(drive_t *drive)
{
    const uint32_t periods = drive->samples.generation;
    const progress_t progress = {
        .periods = periods - drive->task.periods_seen,
        .stalled = (mrai_is_chosen(drive) && mrai_is_stalled(drive)) || periods == drive->task.periods_seen,
    };
    drive->task.periods_seen = periods;
    return progress;
}
