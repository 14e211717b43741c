/* SPDX-License-Identifier: Apache-2.0 */
#include "hal/host/calibration.h"

#include <math.h>

#include "hal/host/instance.h"

#define Q15_SCALE 32768.0
#define Q31_SCALE 2147483648.0
/* A parameter that drifts this fast relative to its own adaptation has no quality: 5 % of psi_f, 20 % of R_0. */
#define PSI_DRIFT_SHARE 0.05
#define R_DRIFT_SHARE 0.20

/* The slow task runs once per torque mean. */
static double task_s(const motor_t *m)
{
    return TORQUE_ESTIMATE_PERIODS * (double)m->bases.period_s;
}

static q31_t to_q31(double x)
{
    return (q31_t)lrint(fmin(fmax(x * Q31_SCALE, -Q31_SCALE), Q31_SCALE - 1.0));
}

static q15_t to_q15(double x)
{
    return (q15_t)lrint(fmin(fmax(x * Q15_SCALE, -Q15_SCALE), Q15_SCALE - 1.0));
}

double calibration_get_torque_slew(const fluxtrue_t *drive)
{
    const motor_t *m = &drive->drive.motor;
    return (m->torque_slew == Q15_MAX) ? 0.0 : m->torque_slew / Q15_SCALE * (double)m->bases.torque_Nm / task_s(m);
}

void calibration_set_torque_slew(fluxtrue_t *drive, double value)
{
    motor_t *m = &drive->drive.motor;
    m->torque_slew = (value > 0.0) ? to_q15(value * task_s(m) / (double)m->bases.torque_Nm) : Q15_MAX;
}

double calibration_get_observer_m(const fluxtrue_t *drive)
{
    const mrai_config_t *c = &drive->drive.motor.mrai;
    return 0.25 * c->pole_gain / c->r0;
}

void calibration_set_observer_m(fluxtrue_t *drive, double value)
{
    mrai_config_t *c = &drive->drive.motor.mrai;
    c->pole_gain = to_q31(4.0 * value * c->r0 / Q31_SCALE);
}

double calibration_get_flux_bandwidth(const fluxtrue_t *drive)
{
    const motor_t *m = &drive->drive.motor;
    return m->mrai.flux_gain / Q31_SCALE * (double)m->bases.omega_rad_s / 2.0;
}

void calibration_set_flux_bandwidth(fluxtrue_t *drive, double value)
{
    motor_t *m = &drive->drive.motor;
    m->mrai.flux_gain = to_q31(2.0 * value / (double)m->bases.omega_rad_s);
    m->mrai.psi_drift_full = to_q31(PSI_DRIFT_SHARE * (double)(m->psi_f_Vs / m->bases.flux_Vs) * value * task_s(m));
}

double calibration_get_resistance_bandwidth(const fluxtrue_t *drive)
{
    const motor_t *m = &drive->drive.motor;
    return m->mrai.resistance_gain / Q31_SCALE * (double)m->bases.omega_rad_s / 2.0;
}

void calibration_set_resistance_bandwidth(fluxtrue_t *drive, double value)
{
    motor_t *m = &drive->drive.motor;
    m->mrai.resistance_gain = to_q31(2.0 * value / (double)m->bases.omega_rad_s);
    m->mrai.r_drift_full = to_q31(R_DRIFT_SHARE * m->mrai.r0 / Q31_SCALE * value * task_s(m));
}

double calibration_get_torque_loop(const fluxtrue_t *drive)
{
    const motor_t *m = &drive->drive.motor;
    return m->torque_loop.ki / Q15_SCALE / task_s(m);
}

void calibration_set_torque_loop(fluxtrue_t *drive, double value)
{
    motor_t *m = &drive->drive.motor;
    m->torque_loop.ki = to_q15(value * task_s(m));
}

double calibration_get_dead_time(const fluxtrue_t *drive)
{
    const motor_t *m = &drive->drive.motor;
    const double full = (double)(m->dead_time_s / m->bases.period_s);
    return (full > 0.0) ? m->modulate.dead_time / Q15_SCALE / full : 0.0;
}

void calibration_set_dead_time(fluxtrue_t *drive, double value)
{
    motor_t *m = &drive->drive.motor;
    m->modulate.dead_time = to_q15(value * (double)(m->dead_time_s / m->bases.period_s));
}
