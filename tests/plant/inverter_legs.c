/* SPDX-License-Identifier: Apache-2.0 */
/* Duty and error bounds of each leg in a period: intact, with an open or a shorted switch, with a broken motor lead. */
#include "inverter.h"

#include "clamp.h"

#define UPPER(x) (x)
#define LOWER(x) ((x) + 3)

/* The current that just recharges the output capacitance of a leg within the dead time (PL-12). */
#define SWITCHING_ZONE_A 0.05
/* Error bound of a broken lead: larger than any voltage, so that its current stays zero. */
#define OPEN_LEAD_V 1e6

static double duty_of(double duty)
{
    return duty != duty ? 0.5 : clamp(duty, 0.0, 1.0);
}

static double dead_share(const plant_params_t *p)
{
    return p->ideal_inverter ? 0.0 : p->dead_time_s * p->pwm_hz;
}

static void leg_off(inverter_t *v, int x)
{
    v->duty[x] = 0.5;
    v->hi_d[x] = v->lo_d[x] = 0.5;
    v->zone_A[x] = v->knee_A[x] = 0.0;
}

/* A pulse shorter than the dead time disappears: the loss is never larger than the pulse. */
static void leg_on(inverter_t *v, int x, double duty, double dead)
{
    const double d = duty_of(duty);
    const int switching = d > 0.0 && d < 1.0;
    v->duty[x] = d;
    v->hi_d[x] = switching ? fmin(dead, d) : 0.0;
    v->lo_d[x] = switching ? fmin(dead, 1.0 - d) : 0.0;
    v->zone_A[x] = SWITCHING_ZONE_A;
}

/* A current that an open switch would have to conduct flows through the other switch's diode (PL-23). */
static void leg_open(inverter_t *v, const plant_params_t *p, int x)
{
    v->hi_d[x] = p->switch_open[UPPER(x)] ? v->duty[x] : v->hi_d[x];
    v->lo_d[x] = p->switch_open[LOWER(x)] ? 1.0 - v->duty[x] : v->lo_d[x];
    v->zone_A[x] = p->switch_open[UPPER(x)] && p->switch_open[LOWER(x)] ? 0.0 : v->zone_A[x];
    v->knee_A[x] = p->switch_open[UPPER(x)] || p->switch_open[LOWER(x)] ? 0.0 : p->leg_knee_A;
}

/* A shorted switch holds the terminal at its rail for any gate signal and any current (PL-24). */
static void leg_shorted(inverter_t *v, const plant_params_t *p, int x)
{
    const int upper = p->switch_shorted[UPPER(x)], lower = p->switch_shorted[LOWER(x)];
    if (upper || lower) {
        v->duty[x] = 0.5 * (1 + (upper != 0) - (lower != 0));
        v->hi_d[x] = v->lo_d[x] = v->hi_V[x] = v->lo_V[x] = 0.0;
    }
}

static void leg_lead(inverter_t *v, const plant_params_t *p, int x)
{
    if (p->phase_open[x]) {
        v->duty[x] = 0.5;
        v->hi_d[x] = v->lo_d[x] = 0.0;
        v->hi_V[x] = v->lo_V[x] = OPEN_LEAD_V;
        v->zone_A[x] = v->knee_A[x] = 0.0;
    }
}

double inverter_short_circuit(const plant_params_t *p, const double duty[3], int gates_on)
{
    double share = 0.0;
    for (int x = 0; x < 3; x++) {
        const int upper = p->switch_shorted[UPPER(x)], lower = p->switch_shorted[LOWER(x)];
        const double d = duty_of(duty[x]), dead = d > 0.0 && d < 1.0 ? dead_share(p) : 0.0;
        const double upper_on = gates_on && !p->switch_open[UPPER(x)] ? fmax(d - dead, 0.0) : 0.0;
        const double lower_on = gates_on && !p->switch_open[LOWER(x)] ? fmax(1.0 - d - dead, 0.0) : 0.0;
        share = upper && lower ? 1.0 : fmax(share, upper ? lower_on : (lower ? upper_on : 0.0));
    }
    return share;
}

int inverter_gates(const plant_params_t *p, int gates_on, double duty[3])
{
    const int imposed = p->imposed_bridge;
    if (imposed == PLANT_BRIDGE_OBEYS) {
        return gates_on && !p->drivers_block;
    }
    duty[0] = duty[1] = duty[2] = imposed == PLANT_BRIDGE_UPPER_ON ? 1.0 : 0.0;
    return imposed != PLANT_BRIDGE_OFF && !p->drivers_block;
}

void inverter_set(inverter_t *v, const plant_params_t *p, const double duty[3], int gates_on, double vdc_V)
{
    const double dead = dead_share(p), drop = p->ideal_inverter ? 0.0 : p->device_drop_V;
    v->exact = 1;
    for (int x = 0; x < 3; x++) {
        if (gates_on) {
            leg_on(v, x, duty[x], dead);
            leg_open(v, p, x);
        } else {
            leg_off(v, x);
        }
        v->hi_V[x] = v->hi_d[x] * vdc_V + drop;
        v->lo_V[x] = v->lo_d[x] * vdc_V + drop;
        leg_shorted(v, p, x);
        leg_lead(v, p, x);
        v->full_hi_V[x] = v->hi_V[x];
        v->full_lo_V[x] = v->lo_V[x];
        v->error_V[x] = clamp(v->error_V[x], -v->lo_V[x], v->hi_V[x]);
        v->exact &= v->hi_V[x] == 0.0 && v->lo_V[x] == 0.0;
    }
}
