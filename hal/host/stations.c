/* SPDX-License-Identifier: Apache-2.0 */
#include "hal/host/stations.h"

#include <string.h>

#include "hal/host/instance.h"
#include "hal/host/per_unit.h"

static double base_Nm(const fluxtrue_t *d)
{
    return (double)d->drive.motor->bases.torque_Nm;
}

static double in_Nm(const fluxtrue_t *d, q15_t torque)
{
    return per_unit_si_from_q15(torque, base_Nm(d));
}

double stations_requested_Nm(const fluxtrue_t *drive)
{
    return drive->on_bus ? (double)drive->ecu.rx.command.torque_requested_Nm : drive->torque_requested_Nm;
}

void stations_set_requested_Nm(fluxtrue_t *drive, double value)
{
    drive->torque_requested_Nm = value;
    drive->drive.request.torque_arbitrated = per_unit_q15_from_si(value, base_Nm(drive));
}

double stations_arbitrated_Nm(const fluxtrue_t *drive)
{
    return in_Nm(drive, drive->drive.request.torque_arbitrated);
}

double stations_limited_Nm(const fluxtrue_t *drive)
{
    return in_Nm(drive, drive->drive.task.allowed.torque_limited);
}

double stations_commanded_Nm(const fluxtrue_t *drive)
{
    return in_Nm(drive, drive->drive.task.torque_commanded);
}

double stations_corrected_Nm(const fluxtrue_t *drive)
{
    return in_Nm(drive, drive->drive.task.torque_corrected);
}

double stations_estimated_Nm(const fluxtrue_t *drive)
{
    return in_Nm(drive, drive->drive.task.identification.torque_estimated);
}

/* Names of version 0.1, understood until 0.3. Its torque_limited_Nm was the commanded torque; that name now belongs to
 * the limited one and cannot serve both. */
static const struct {
    const char *old, *present;
} renamed[] = {
    {"torque_command_Nm", "torque_requested_Nm"},
    {"torque_request_Nm", "torque_corrected_Nm"},
    {"torque_estimate_Nm", "torque_estimated_Nm"},
    {"contradiction", "mismatch_share"},
};

const char *stations_name(const char *name)
{
    for (size_t k = 0; name && k < sizeof renamed / sizeof renamed[0]; k++) {
        if (strcmp(name, renamed[k].old) == 0) {
            return renamed[k].present;
        }
    }
    return name;
}
