/* SPDX-License-Identifier: Apache-2.0 */
#include "hal/host/limits.h"

#include <math.h>

#include "drive/slow_monitors.h"
#include "hal/host/instance.h"

static double torque_base(const fluxtrue_t *d)
{
    return (double)d->drive.motor->bases.torque_Nm;
}

/* On the dc side: P_b = 1.5 V_b I_b. */
static double power_base(const fluxtrue_t *d)
{
    return 1.5 * (double)d->drive.motor->bases.voltage_V * (double)d->drive.motor->bases.current_A;
}

static q15_t to_limit(double x, double base)
{
    return (q15_t)lrint(fmin(x / base * 32768.0, 32767.0));
}

double limits_get_inverter(const fluxtrue_t *drive)
{
    return drive->board.inverter_C;
}

void limits_set_inverter(fluxtrue_t *drive, double value)
{
    drive->board.inverter_C = value;
}

double limits_get_torque_drive(const fluxtrue_t *drive)
{
    return drive->drive.request.limits.torque_drive / 32768.0 * torque_base(drive);
}

void limits_set_torque_drive(fluxtrue_t *drive, double value)
{
    drive->drive.request.limits.torque_drive = to_limit(value, torque_base(drive));
}

double limits_get_torque_regen(const fluxtrue_t *drive)
{
    return drive->drive.request.limits.torque_regen / 32768.0 * torque_base(drive);
}

void limits_set_torque_regen(fluxtrue_t *drive, double value)
{
    drive->drive.request.limits.torque_regen = to_limit(value, torque_base(drive));
}

double limits_get_power_drive(const fluxtrue_t *drive)
{
    return drive->drive.request.limits.power_drive / 32768.0 * power_base(drive);
}

void limits_set_power_drive(fluxtrue_t *drive, double value)
{
    drive->drive.request.limits.power_drive = to_limit(value, power_base(drive));
}

double limits_get_power_regen(const fluxtrue_t *drive)
{
    return drive->drive.request.limits.power_regen / 32768.0 * power_base(drive);
}

void limits_set_power_regen(fluxtrue_t *drive, double value)
{
    drive->drive.request.limits.power_regen = to_limit(value, power_base(drive));
}

double limits_get_machine_monitors(const fluxtrue_t *drive)
{
    return drive->drive.motor->plausibility.e_0 != Q15_MAX;
}

void limits_set_machine_monitors(fluxtrue_t *drive, double value)
{
    drive->motor = motor;
    if (value == 0.0) {
        slow_monitors_without_machine(&drive->motor);
    }
}
