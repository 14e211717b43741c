/* SPDX-License-Identifier: Apache-2.0 */
#include "hal/host/limits.h"

#include "drive/slow_monitors.h"
#include "hal/host/instance.h"
#include "hal/host/per_unit.h"

static double torque_base(const fluxtrue_t *d)
{
    return (double)d->drive.motor->bases.torque_Nm;
}

/* On the dc side: P_b = 1.5 V_b I_b. */
static double power_base(const fluxtrue_t *d)
{
    return 1.5 * (double)d->drive.motor->bases.voltage_V * (double)d->drive.motor->bases.current_A;
}

double limits_get_inverter(const fluxtrue_t *drive)
{
    return drive->board.inverter_C;
}

void limits_set_inverter(fluxtrue_t *drive, double value)
{
    drive->board.inverter_C = value;
}

double limits_get_known_share(const fluxtrue_t *drive)
{
    return drive->board.known_share;
}

void limits_set_known_share(fluxtrue_t *drive, double value)
{
    drive->board.known_share = value;
}

/* A limit of the request, by its name there. */
#define LIMIT(name, base) \
    double limits_get_##name(const fluxtrue_t *drive) \
    { \
        return per_unit_si_from_q15(drive->drive.request.limits.name, base(drive)); \
    } \
    void limits_set_##name(fluxtrue_t *drive, double value) \
    { \
        drive->drive.request.limits.name = per_unit_q15_from_si(value, base(drive)); \
    }

LIMIT(torque_drive, torque_base)
LIMIT(torque_regen, torque_base)
LIMIT(power_drive, power_base)
LIMIT(power_regen, power_base)

double limits_get_machine_monitors(const fluxtrue_t *drive)
{
    return drive->drive.motor->plausibility.e_0 != Q15_MAX;
}

void limits_set_machine_monitors(fluxtrue_t *drive, double value)
{
    drive->motor = *drive->data;
    if (value == 0.0) {
        slow_monitors_without_machine(&drive->motor);
    }
}
