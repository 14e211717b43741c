/* SPDX-License-Identifier: Apache-2.0 */
#include "hal/host/spun.h"

#include <math.h>

#include "hal/host/instance.h"

/* A value, by its place in the instance. */
#define VALUE(name, member, from) \
    double spun_##name(const fluxtrue_t *d) \
    { \
        return (double)d->member; \
    } \
    void spun_set_##name(fluxtrue_t *d, double value) \
    { \
        d->member = (from); \
    }

VALUE(reversed, angle_source.asked.reversed, value != 0.0)
VALUE(offset_rad, angle_source.asked.offset_rad, value)
VALUE(imposed, angle_source.asked.imposed, value != 0.0)
VALUE(imposed_hz, angle_source.imposed_hz, value)
VALUE(rpm, spin_limit.rpm_max, value)

double spun_pole_pairs(const fluxtrue_t *d)
{
    const double asked = d->angle_source.asked.pole_pairs;
    return (asked == 0.0) ? (double)d->drive.motor->angle_tracker.pole_pairs : asked;
}

void spun_set_pole_pairs(fluxtrue_t *d, double value)
{
    d->angle_source.asked.pole_pairs = value;
}

double spun_periods(const fluxtrue_t *d)
{
    return (double)d->spin_limit.periods;
}

void spun_set_periods(fluxtrue_t *d, double value)
{
    d->spin_limit.periods = (uint32_t)lrint(value);
    d->spin_limit.failure = SPIN_GOOD;
}

double spun_turns(const fluxtrue_t *d)
{
    return d->angle_source.turns;
}

double spun_failure(const fluxtrue_t *d)
{
    return (double)d->spin_limit.failure;
}
