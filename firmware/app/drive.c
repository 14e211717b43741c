/* SPDX-License-Identifier: Apache-2.0 */
#include "app/drive.h"

bool motor_valid(const motor_t *m)
{
    return flux_table_valid(&m->flux_table) && current_reference_valid(&m->current_reference) && m->torque_max > 0 &&
           m->monitor.i_trip > 0 && m->monitor.i_trip < Q15(0.8) && m->monitor.v_min < m->monitor.v_max &&
           mrai_valid(&m->mrai) && m->modulate.v_dc_min > 1 && m->modulate.knee_gain > 0 && m->modulate.knee_gain < (1 << 29);
}

void drive_init(drive_t *drive, const motor_t *source)
{
    *drive = (drive_t){.motor = *source, .request = {.torque_loop = true, .identification = true}};
    if (!motor_valid(source)) {
        drive_raise_fault(drive, FAULT_CONFIG);
    }
}

void drive_raise_fault(drive_t *drive, uint32_t fault)
{
    drive->fast.faults = drive->fast.faults | fault;
}
