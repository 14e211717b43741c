/* SPDX-License-Identifier: Apache-2.0 */
#include "hal/host/pulsed.h"

#include <math.h>

#include "hal/host/instance.h"
#include "hal/host/per_unit.h"

#define TURN_RAD 6.283185307179586
#define TURN 4294967296.0

static double current_base(const fluxtrue_t *d)
{
    return (double)d->drive.motor->bases.current_A;
}

static double share(const fluxtrue_t *d)
{
    (void)d;
    return 1.0;
}

/* A value in q15, by its place in the configuration. */
#define Q15_VALUE(name, member, base) \
    double pulsed_##name(const fluxtrue_t *d) \
    { \
        return per_unit_si_from_q15(d->drive.request.pulses.config.member, base(d)); \
    } \
    void pulsed_set_##name(fluxtrue_t *d, double value) \
    { \
        d->drive.request.pulses.config.member = per_unit_q15_from_si(value, base(d)); \
    }

#define COUNT_VALUE(name, member) \
    double pulsed_##name(const fluxtrue_t *d) \
    { \
        return (double)d->drive.request.pulses.config.member; \
    } \
    void pulsed_set_##name(fluxtrue_t *d, double value) \
    { \
        d->drive.request.pulses.config.member = (uint16_t)lrint(value); \
    }

Q15_VALUE(vd, d.v, share)
Q15_VALUE(vq, q.v, share)
Q15_VALUE(first, first, share)
Q15_VALUE(id_low_A, d.low, current_base)
Q15_VALUE(id_high_A, d.high, current_base)
Q15_VALUE(iq_low_A, q.low, current_base)
Q15_VALUE(iq_high_A, q.high, current_base)
COUNT_VALUE(delay, delay)
COUNT_VALUE(reversals, reversals)
COUNT_VALUE(periods, periods_max)

double pulsed_angle_rad(const fluxtrue_t *d)
{
    return d->drive.request.pulses.config.angle_max / TURN * TURN_RAD;
}

void pulsed_set_angle_rad(fluxtrue_t *d, double value)
{
    d->drive.request.pulses.config.angle_max = (uint32_t)llrint(value / TURN_RAD * TURN);
}

double pulsed_phase(const fluxtrue_t *d)
{
    return (double)d->drive.task.pulsing.phase;
}

void pulsed_start(fluxtrue_t *d, double value)
{
    d->drive.request.pulses.starts += (value != 0.0) ? 1U : 0U;
}

double pulsed_failure(const fluxtrue_t *d)
{
    return (double)d->drive.task.pulsing.failure;
}

double pulsed_agreed(const fluxtrue_t *d)
{
    return d->drive.request.pulses_agreed ? 1.0 : 0.0;
}

void pulsed_agree(fluxtrue_t *d, double value)
{
    const bool may_last = d->drive.request.pulses_agreed || d->drive.task.run_state != RUN_STATE_RUN;
    d->drive.request.pulses_agreed = value != 0.0 && may_last;
}

double pulsed_theta_rad(const fluxtrue_t *d)
{
    const sample_t *sample = sample_box_at(&d->drive.samples, d->drive.samples.generation);
    return sample->theta_e / TURN * TURN_RAD;
}
