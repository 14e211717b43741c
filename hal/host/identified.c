/* SPDX-License-Identifier: Apache-2.0 */
#include "hal/host/identified.h"

#include <math.h>

#include "hal/host/instance.h"
#include "hal/host/per_unit.h"

static bool is_robust(const fluxtrue_t *d)
{
    return d->drive.request.identification_mode == IDENTIFICATION_ROBUST;
}

static double value(const fluxtrue_t *d, identify_index_t index, float base)
{
    const drive_t *drive = &d->drive;
    const q31_t identified = identify_value(&drive->motor->identify, &drive->task.identify, index);
    return is_robust(d) ? per_unit_si_from_q31(identified, (double)base) : 0.0;
}

double identified_psi_f_Vs(const fluxtrue_t *d)
{
    const motor_t *m = d->drive.motor;
    return (double)m->psi_f_Vs + per_unit_si_from_q31(d->drive.task.identification.psi_delta, (double)m->bases.flux_Vs);
}

double identified_r_ohm(const fluxtrue_t *d)
{
    const motor_t *m = d->drive.motor;
    return (double)m->r_ohm_20 +
           per_unit_si_from_q31(d->drive.task.identification.r_delta, (double)m->bases.resistance_ohm);
}

double identified_drop_V(const fluxtrue_t *d)
{
    return value(d, IDENTIFY_DROP, d->drive.motor->bases.voltage_V);
}

double identified_lq_scale(const fluxtrue_t *d)
{
    return 1.0 + value(d, IDENTIFY_LQ, 1.0F);
}

double identified_ld_scale(const fluxtrue_t *d)
{
    return 1.0 + value(d, IDENTIFY_LD, 1.0F);
}

double identified_angle_rad(const fluxtrue_t *d)
{
    return value(d, IDENTIFY_ANGLE, 1.0F);
}

double identified_iron_scale(const fluxtrue_t *d)
{
    return 1.0 + value(d, IDENTIFY_IRON, 1.0F);
}

double identified_clamped(const fluxtrue_t *d)
{
    return (double)(is_robust(d) && d->drive.task.identify.kept.clamped);
}

double identified_confidence(const fluxtrue_t *d)
{
    return is_robust(d) ? (double)d->drive.task.identification.confidence / 32767.0 : 1.0;
}

double identified_mismatch_share(const fluxtrue_t *d)
{
    return is_robust(d) ? per_unit_si_from_q15(d->drive.task.identify.kept.mismatch_share, 1.0) : 0.0;
}

double identified_local_Vs(const fluxtrue_t *d)
{
    const dq_q30_t local = d->drive.task.identify.kept.local;
    const double length = hypot((double)local.d, (double)local.q);
    return is_robust(d) ? length / 1073741824.0 * (double)d->drive.motor->bases.flux_Vs : 0.0;
}
