/* SPDX-License-Identifier: Apache-2.0 */
#include "calibration/measurements.h"

#include "drive/mrai/mrai_seam.h"
#include "hal/temperature.h"
#include "types/si.h"

#define RPM_PER_RAD_S 9.5492966F

#define MEASURED(drive) ((drive)->samples.slot[(drive)->samples.generation & 1U])

static float measured_speed_rpm(const drive_t *drive)
{
    const motor_t *m = drive->motor;
    const float omega = si_from_q31(MEASURED(drive).point.omega, m->bases.omega_rad_s);
    return omega * RPM_PER_RAD_S / (float)m->angle_tracker.pole_pairs;
}

static float measured_psi_f_Vs(const drive_t *drive)
{
    const motor_t *m = drive->motor;
    return m->psi_f_Vs + si_from_q31(drive->task.identification.psi_delta, m->bases.flux_Vs);
}

static float measured_r_ohm(const drive_t *drive)
{
    const motor_t *m = drive->motor;
    return m->r_ohm_20 + si_from_q31(drive->task.identification.r_delta, m->bases.resistance_ohm);
}

#define FILL(name, type, base, expression, text) .name = (MEASUREMENT_TYPE_##type)(expression),

void measurements_step(measurements_t *measurements, const drive_t *d)
{
    *measurements = (measurements_t){MEASUREMENT_LIST(FILL)};
}
