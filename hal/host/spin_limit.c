/* SPDX-License-Identifier: Apache-2.0 */
#include "hal/host/spin_limit.h"

#include <math.h>

#define MEAN_PERIODS 16.0

static void follow(spin_limit_t *limit, double turns, double period_s)
{
    const double rpm = (turns - limit->turns) / period_s * 60.0;
    limit->rpm += (rpm - limit->rpm) / MEAN_PERIODS;
    limit->turns = turns;
}

bool spin_limit_step(spin_limit_t *limit, double sensor_turns, double period_s)
{
    follow(limit, sensor_turns, period_s);
    if (limit->periods == 0U) {
        return limit->failure == SPIN_GOOD;
    }
    limit->periods--;
    if (fabs(limit->rpm) > limit->rpm_max) {
        limit->failure = SPIN_FAST;
        limit->periods = 0;
    } else if (limit->periods == 0U) {
        limit->failure = SPIN_SILENT;
    }
    return limit->periods != 0U;
}
