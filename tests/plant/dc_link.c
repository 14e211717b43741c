/* SPDX-License-Identifier: Apache-2.0 */
#include "dc_link.h"

#include <math.h>

/* dv/dt = rate (v_end - v) */
static double towards(double v_V, double v_end_V, double rate, double dt_s)
{
    return v_end_V + (v_V - v_end_V) * exp(-rate * dt_s);
}

double dc_link_step(const plant_params_t *p, const plant_switches_t *on, double v_V, double battery_V,
                    double i_bridge_A, double dt_s, double *avalanche_J)
{
    if (on->contactor && !p->contactor_open) {
        return fmax(battery_V, p->vdc_least_V);
    }
    const double pre = on->precharge && !p->precharge_open ? 1.0 / p->precharge_s : 0.0;
    const double dis = on->discharge && !p->discharge_open ? 1.0 / p->discharge_s : 0.0;
    const double load = p->dc_load_ohm > 0.0 ? 1.0 / (p->dc_load_ohm * p->dc_link_F) : 0.0;
    const double slope = pre * battery_V - i_bridge_A / p->dc_link_F, rate = pre + dis + load;
    const double next_V = rate > 0.0 ? towards(v_V, slope / rate, rate, dt_s) : v_V + dt_s * slope;
    if (next_V > p->avalanche_V) {
        *avalanche_J += 0.5 * p->dc_link_F * (next_V * next_V - p->avalanche_V * p->avalanche_V);
        return p->avalanche_V;
    }
    return fmax(next_V, p->vdc_least_V);
}
