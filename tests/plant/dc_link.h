/* SPDX-License-Identifier: Apache-2.0 */
#ifndef PLANT_DC_LINK_H
#define PLANT_DC_LINK_H
/** The capacitor between battery and bridge, with the switches that the inverter's board controls.
 *   C dv/dt = (C/tau_pre)(V_bat - v) [precharge] - (C/tau_dis) v [discharge] - v/R_load - i_bridge
 *   v = V_bat while the contactor is closed;  v <= V_avalanche: above it the semiconductors conduct
 * Source   docs/theory/plant.md (PL-21), (PL-22)
 * Units    V, A, s
 * Range    v >= vdc_least_V, by default 1 V, so that the errors of the inverter model, which are shares of v, do not
 *          vanish
 * Rounding exact for a bridge current that is constant over the step
 * Context  simulation only; pure */
#include "plant_params.h"

typedef struct {
    int precharge, contactor, discharge;
    int gate_supply;   /* off: no gate can be switched on by the processor */
    int hardware_safe; /* the safe state of the board's hardware is requested */
} plant_switches_t;

/** Returns the voltage after dt_s; adds the energy that the semiconductors dissipate to avalanche_J. */
double dc_link_step(const plant_params_t *p, const plant_switches_t *on, double v_V, double battery_V,
                    double i_bridge_A, double dt_s, double *avalanche_J);

#endif
