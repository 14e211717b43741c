/* SPDX-License-Identifier: Apache-2.0 */
#include "calibration/mrai/mrai_calibration.h"

#include "drive/data_check.h"
#include "types/si.h"

/* Drift that means quality 0: an error of 5 % of psi_f, 20 % of R_0, at the law's own bandwidth. */
#define PSI_DRIFT_SHARE 0.05F
#define R_DRIFT_SHARE 0.20F

/* pole_gain of m = 1: 4 R_0 2^g_shift. */
static float pole_per_m(const mrai_config_t *config)
{
    const float four_r0 = 4.0F * si_from_q31(config->r0, 1.0F);
    const uint32_t scale = 1U << (uint32_t)fx_abs_q15(config->g_shift);
    return (config->g_shift < 0) ? four_r0 / (float)scale : four_r0 * (float)scale;
}

float mrai_calibration_get(const drive_t *drive, calibration_id_t id)
{
    const mrai_config_t *p = &drive->mrai_parameters;
    const float omega_rad_s = drive->motor->bases.omega_rad_s;
    if (id == CALIBRATION_observer_m) {
        return si_from_q31(p->pole_gain, 1.0F) / pole_per_m(p);
    }
    if (id == CALIBRATION_flux_bandwidth_rad_s) {
        return si_from_q31(p->flux_gain, omega_rad_s) / 2.0F;
    }
    return (id == CALIBRATION_resistance_bandwidth_rad_s) ? si_from_q31(p->resistance_gain, omega_rad_s) / 2.0F : 0.0F;
}

/* Drift that means quality 0 at this bandwidth, per unit and step. */
static float psi_drift_full(const motor_t *m, float bandwidth)
{
    return PSI_DRIFT_SHARE * m->psi_f_Vs / m->bases.flux_Vs * bandwidth * m->bases.step_s;
}

static float r_drift_full(const drive_t *drive, float bandwidth)
{
    return R_DRIFT_SHARE * si_from_q31(drive->mrai_parameters.r0, 1.0F) * bandwidth * drive->motor->bases.step_s;
}

static float larger(float a, float b)
{
    return (a > b) ? a : b;
}

/* Neither the gain nor the drift may become zero. */
static float least_bandwidth(const drive_t *drive, float drift_full)
{
    return larger(si_from_q31(1, drive->motor->bases.omega_rad_s) / 2.0F, si_from_q31(1, 1.0F) / drift_full);
}

float mrai_calibration_least(const drive_t *drive, calibration_id_t id)
{
    if (id == CALIBRATION_flux_bandwidth_rad_s) {
        return least_bandwidth(drive, psi_drift_full(drive->motor, 1.0F));
    }
    return (id == CALIBRATION_resistance_bandwidth_rad_s) ? least_bandwidth(drive, r_drift_full(drive, 1.0F)) : 0.0F;
}

void mrai_calibration_set(drive_t *drive, calibration_id_t id, float value)
{
    mrai_config_t *p = &drive->mrai_parameters;
    const mrai_config_t before = *p;
    const float omega_rad_s = drive->motor->bases.omega_rad_s;
    if (id == CALIBRATION_observer_m) {
        p->pole_gain = q31_from_si(value * pole_per_m(p), 1.0F);
    } else if (id == CALIBRATION_flux_bandwidth_rad_s) {
        p->flux_gain = q31_from_si(2.0F * value, omega_rad_s);
        p->psi_drift_full = q31_from_si(psi_drift_full(drive->motor, value), 1.0F);
    } else if (id == CALIBRATION_resistance_bandwidth_rad_s) {
        p->resistance_gain = q31_from_si(2.0F * value, omega_rad_s);
        p->r_drift_full = q31_from_si(r_drift_full(drive, value), 1.0F);
    }
    data_check_accept_mrai(drive, &before);
}
