/* SPDX-License-Identifier: Apache-2.0 */
#include "drive/drive_si.h"

#include "types/si.h"

#define RPM_PER_RAD_S 9.5492966F

float drive_speed_rpm(const drive_t *drive, q31_t omega)
{
    const motor_t *m = drive->motor;
    return si_from_q31(omega, m->bases.omega_rad_s) / (float)m->angle_tracker.pole_pairs * RPM_PER_RAD_S;
}

float drive_psi_f_Vs(const drive_t *drive)
{
    const motor_t *m = drive->motor;
    return m->psi_f_Vs + si_from_q31(drive->task.identification.psi_delta, m->bases.flux_Vs);
}

float drive_r_ohm(const drive_t *drive)
{
    const motor_t *m = drive->motor;
    return m->r_ohm_20 + si_from_q31(drive->task.identification.r_delta, m->bases.resistance_ohm);
}
