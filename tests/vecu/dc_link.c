/* SPDX-License-Identifier: Apache-2.0 */
#include "dc_link.h"

#include <math.h>

#define V_LEAST 1.0

void dc_link_params_default(dc_link_params_t *p, double battery_V)
{
    /* Assumed: 500 uF, charged to 95 % in 60 ms, discharged to 5 % in 0.3 s. */
    *p = (dc_link_params_t){.battery_V = battery_V, .capacitance_F = 500e-6, .precharge_s = 0.02, .discharge_s = 0.1};
}

double dc_link_step(const dc_link_params_t *p, dc_link_switches_t s, double v_V, double i_bridge_A, double dt_s)
{
    if (s.contactor && p->contactor_open == 0.0) {
        return fmax(p->battery_V, V_LEAST);
    }
    double slope = -i_bridge_A / p->capacitance_F;
    if (s.precharge && p->precharge_open == 0.0) {
        slope += (p->battery_V - v_V) / p->precharge_s;
    }
    if (s.discharge && p->discharge_open == 0.0) {
        slope -= v_V / p->discharge_s;
    }
    return fmax(v_V + dt_s * slope, V_LEAST);
}
