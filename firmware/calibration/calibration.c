/* SPDX-License-Identifier: Apache-2.0 */
#include "calibration/calibration.h"

#include "drive/data_check.h"
#include "types/si.h"

/* Drift that means quality 0: an error of 5 % of psi_f, 20 % of R_0, at the law's own bandwidth. */
#define PSI_DRIFT_SHARE 0.05F
#define R_DRIFT_SHARE 0.20F

#define INFO(name, lo, hi, unit, text) {#name, lo, hi},
const calibration_info_t calibration_info[CALIBRATION_COUNT] = {CALIBRATION_LIST(INFO)};

float calibration_get(const drive_t *drive, calibration_id_t id)
{
    const motor_t *m = drive->motor;
    const motor_parameters_t *p = &drive->parameters;
    switch (id) {
    case CALIBRATION_torque_slew_Nm_per_s:
        return (p->torque_slew == Q15_MAX) ? 0.0F : si_from_q15(p->torque_slew, m->bases.torque_Nm) / m->bases.step_s;
    case CALIBRATION_observer_m:
        return 0.25F * (float)p->mrai.pole_gain / (float)p->mrai.r0;
    case CALIBRATION_flux_bandwidth_rad_s:
        return si_from_q31(p->mrai.flux_gain, m->bases.omega_rad_s) / 2.0F;
    case CALIBRATION_resistance_bandwidth_rad_s:
        return si_from_q31(p->mrai.resistance_gain, m->bases.omega_rad_s) / 2.0F;
    case CALIBRATION_torque_loop_bandwidth_rad_s:
        return si_from_q15(p->torque_loop.ki, 1.0F) / m->bases.step_s;
    case CALIBRATION_dead_time_compensation:
        return (m->bridge_duty > 0.0F) ? si_from_q15(p->modulate.dead_time_q16, 0.5F) / m->bridge_duty : 0.0F;
    case CALIBRATION_COUNT:
    default:
        return 0.0F;
    }
}

/* Drift that means quality 0 at this bandwidth, per unit and step. */
static float psi_drift_full(const motor_t *m, float bandwidth)
{
    return PSI_DRIFT_SHARE * m->psi_f_Vs / m->bases.flux_Vs * bandwidth * m->bases.step_s;
}

static float r_drift_full(const drive_t *drive, float bandwidth)
{
    return R_DRIFT_SHARE * si_from_q31(drive->parameters.mrai.r0, 1.0F) * bandwidth * drive->motor->bases.step_s;
}

static float larger(float a, float b)
{
    return (a > b) ? a : b;
}

float calibration_least(const drive_t *drive, calibration_id_t id)
{
    const motor_t *m = drive->motor;
    switch (id) {
    case CALIBRATION_torque_slew_Nm_per_s:
        return si_from_q15(1, m->bases.torque_Nm) / m->bases.step_s;
    case CALIBRATION_flux_bandwidth_rad_s:
        return larger(si_from_q31(1, m->bases.omega_rad_s) / 2.0F, si_from_q31(1, 1.0F) / psi_drift_full(m, 1.0F));
    case CALIBRATION_resistance_bandwidth_rad_s:
        return larger(si_from_q31(1, m->bases.omega_rad_s) / 2.0F, si_from_q31(1, 1.0F) / r_drift_full(drive, 1.0F));
    case CALIBRATION_torque_loop_bandwidth_rad_s:
        return si_from_q15(1, 1.0F) / m->bases.step_s;
    case CALIBRATION_dead_time_compensation:
        return (m->bridge_duty > 0.0F) ? si_from_q15(1, 1.0F) / m->bridge_duty : 0.0F;
    case CALIBRATION_observer_m:
    case CALIBRATION_COUNT:
    default:
        return 0.0F;
    }
}

static void write_parameter(const motor_t *m, motor_parameters_t *p, calibration_id_t id, float value)
{
    switch (id) {
    case CALIBRATION_torque_slew_Nm_per_s:
        p->torque_slew = (value > 0.0F) ? q15_from_si(value * m->bases.step_s, m->bases.torque_Nm) : Q15_MAX;
        break;
    case CALIBRATION_observer_m:
        p->mrai.pole_gain = q31_from_si(4.0F * value * si_from_q31(p->mrai.r0, 1.0F), 1.0F);
        break;
    case CALIBRATION_flux_bandwidth_rad_s:
        p->mrai.flux_gain = q31_from_si(2.0F * value, m->bases.omega_rad_s);
        p->mrai.psi_drift_full = q31_from_si(psi_drift_full(m, value), 1.0F);
        break;
    case CALIBRATION_resistance_bandwidth_rad_s:
        p->mrai.resistance_gain = q31_from_si(2.0F * value, m->bases.omega_rad_s);
        p->mrai.r_drift_full = q31_from_si(r_drift_full(drive, value), 1.0F);
        break;
    case CALIBRATION_torque_loop_bandwidth_rad_s:
        p->torque_loop.ki = q15_from_si(value * m->bases.step_s, 1.0F);
        break;
    case CALIBRATION_dead_time_compensation:
        drive_set_dead_time(p, q15_from_si(value * m->bridge_duty, 1.0F));
        break;
    case CALIBRATION_COUNT:
    default:
        break;
    }
}

void calibration_set(drive_t *drive, calibration_id_t id, float value)
{
    const motor_parameters_t before = drive->parameters;
    write_parameter(drive->motor, &drive->parameters, id, value);
    data_check_accept(drive, &before);
}
