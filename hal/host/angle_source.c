/* SPDX-License-Identifier: Apache-2.0 */
#include "hal/host/angle_source.h"

#include <math.h>

#define TURN_RAD 6.283185307179586
#define TURN 4294967296.0

static double fraction(double turns)
{
    return turns - floor(turns);
}

static bool is_same(const angle_connection_t *a, const angle_connection_t *b)
{
    return a->pole_pairs == b->pole_pairs && a->offset_rad == b->offset_rad && a->reversed == b->reversed &&
           a->imposed == b->imposed;
}

/* The connection of a new drive, with nothing set. */
static const angle_connection_t plain;

static double electrical_turns(const angle_source_t *source, double pole_pairs)
{
    const angle_connection_t *c = &source->acting;
    if (c->imposed) {
        return source->imposed;
    }
    const double turns = source->turns * ((c->pole_pairs == 0.0) ? pole_pairs : c->pole_pairs);
    return (c->reversed ? -turns : turns) + c->offset_rad / TURN_RAD;
}

uint32_t angle_source_step(angle_source_t *source, const angle_source_in_t *in, double sensor_turns, bool *changed)
{
    source->turns += fraction(sensor_turns - source->turns + 0.5) - 0.5;
    source->imposed += source->imposed_hz * in->period_s;
    *changed = !in->gates && !is_same(&source->asked, &source->acting);
    if (*changed) {
        source->acting = source->asked;
    }
    if (is_same(&source->acting, &plain)) {
        return (uint32_t)(fraction(sensor_turns) * (TURN - 1.0));
    }
    return (uint32_t)(fraction(electrical_turns(source, in->pole_pairs) / in->pole_pairs) * (TURN - 1.0));
}
