/* SPDX-License-Identifier: Apache-2.0 */
#include "twin/twin_trim.h"

#include <math.h>

static const double pi = 3.14159265358979324;

/* (DT-2), (DT-3) */
double twin_trim(twin_trim_t *state, double drop, double v_dc)
{
    const double range = state->base / 4.0;
    const double wanted = state->trim + pi / 4.0 * drop / v_dc / 16.0;
    const double trim = fmin(fmax(wanted, -range), range);
    const double moved = trim - state->trim;
    state->trim = trim;
    return drop - 4.0 / pi * v_dc * moved;
}
