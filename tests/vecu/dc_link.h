/* SPDX-License-Identifier: Apache-2.0 */
#ifndef VECU_DC_LINK_H
#define VECU_DC_LINK_H
/** The capacitor between battery and bridge, with its three switches.
 *   (VB-3)  C dv/dt = (V_bat - v)/R_pre [precharge] - v/R_dis [discharge] - i_bridge
 *           v = V_bat while the contactor is closed
 * Units    V, A, s; resistances are given by their time constants with C
 * Range    v >= 1 V: the machine model divides by it
 * Context  simulation only; pure; one step per PWM period, the bridge's current is the last period's mean */
#include <stdbool.h>

typedef struct {
    double battery_V;
    double capacitance_F, precharge_s, discharge_s;        /* time constants */
    double precharge_open, discharge_open, contactor_open; /* not 0: the switch does not close */
} dc_link_params_t;

typedef struct {
    bool precharge, contactor, discharge;
} dc_link_switches_t;

void dc_link_params_default(dc_link_params_t *p, double battery_V);
/** The voltage after dt. */
double dc_link_step(const dc_link_params_t *p, dc_link_switches_t s, double v_V, double i_bridge_A, double dt_s);

#endif
