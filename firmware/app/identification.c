/* SPDX-License-Identifier: Apache-2.0 */
#include "app/drive.h"
#include "hal/temperature.h"

/* Ten periods from the MRAI ISR, the tables at their magnetising current, and what follows from both. */
static void robust(drive_t *drive, const sample_t *sample)
{
    const motor_t *m = &drive->motor;
    task_state_t *task = &drive->task;
    const int16_t winding_dC = hal_temperature_winding_dC();
    const identify_window_t window = window_box_read(&drive->windows);
    const identify_point_t point = identify_point(&m->identify, &window, sample->mrai.omega);
    const flux_point_t flux = flux_table_step(&m->flux_table, point.i_m);
    const identify_in_t in = {
        .point = &point,
        .flux = &flux,
        .temperature_known = winding_dC != HAL_TEMPERATURE_UNKNOWN,
        .winding_dC = winding_dC,
        .enabled = drive->request.identification && sample->acting,
    };
    task->identified = identify_step(&m->identify, &task->identify, &in);
    task->identifications = task->identifications + 1U;
    task->torque_estimate = task->identified.torque;
}

void drive_identify(drive_t *drive, const sample_t *sample)
{
    if (drive->request.identification_mode == IDENTIFICATION_ROBUST) {
        robust(drive, sample);
    } else {
        drive->task.torque_estimate = drive->slow.torque.mean;
    }
}

identify_memory_t drive_learnt(const drive_t *drive)
{
    identify_memory_t memory;
    uint32_t seen;
    do {
        seen = drive->task.identifications;
        exchange_barrier();
        memory = identify_memory_get(&drive->task.identify);
        exchange_barrier();
    } while (drive->task.identifications != seen);
    return memory;
}

bool drive_recall(drive_t *drive, const identify_memory_t *memory)
{
    return identify_memory_restore(&drive->task.identify, memory);
}
