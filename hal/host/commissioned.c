/* SPDX-License-Identifier: Apache-2.0 */
#include "hal/host/commissioned.h"

#include "hal/host/instance.h"
#include "hal/host/per_unit.h"

#define ONE_Q30 1073741824.0

double commissioned_phase(const fluxtrue_t *d)
{
    return (double)d->drive.task.commission.phase;
}

void commissioned_start(fluxtrue_t *d, double value)
{
    d->drive.request.commissionings += (value != 0.0) ? 1U : 0U;
}

double commissioned_failure(const fluxtrue_t *d)
{
    return (double)d->drive.task.commission.failure;
}

double commissioned_r_ohm(const fluxtrue_t *d)
{
    return (double)d->drive.task.inverter.r / ONE_Q30 * (double)d->drive.motor->bases.resistance_ohm;
}

double commissioned_trims(const fluxtrue_t *d)
{
    return (double)d->drive.request.trim;
}

void commissioned_set_trim(fluxtrue_t *d, double value)
{
    d->drive.request.trim = value != 0.0;
}

/* The compensation in effect, at the present dc voltage. */
double commissioned_level_V(const fluxtrue_t *d)
{
    const double v_dc_V = per_unit_si_from_q15(d->drive.samples.slot[d->drive.samples.generation % SAMPLE_SLOTS].v_dc,
                                               (double)d->drive.motor->bases.voltage_V);
    return (double)d->drive.parameters.modulate.dead_time_q16 / 65536.0 * v_dc_V;
}

double commissioned_knee_A(const fluxtrue_t *d)
{
    return 131072.0 / (double)d->drive.parameters.modulate.knee_q17 * (double)d->drive.motor->bases.current_A;
}

#define DEFINITION(k) \
    double commissioned_##k##_A(const fluxtrue_t *d) \
    { \
        return (double)d->drive.task.inverter.knot[k] / ONE_Q30 * (double)d->drive.motor->bases.current_A; \
    } \
    double commissioned_##k##_V(const fluxtrue_t *d) \
    { \
        return (double)d->drive.task.inverter.v[k] / ONE_Q30 * (double)d->drive.motor->bases.voltage_V; \
    }

COMMISSIONED_POINTS(DEFINITION)
