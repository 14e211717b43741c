/* SPDX-License-Identifier: Apache-2.0 */
#ifndef PLANT_INVERTER_H
#define PLANT_INVERTER_H
/** Two-level inverter, averaged over the PWM period. Each leg's error opposes its current, as dry friction a motion:
 *   v_x = v_dc d_x - e_x,  e_x = hi_x for i_x > 0, -lo_x for i_x < 0, between: the value that holds i_x at 0
 *   u_s = (2/3) sum v_x e^(j 2 pi x/3) + series_V
 *   switching:  hi, lo = dead-time loss + drop;   disabled:  d = 1/2, hi = lo = v_dc/2 + drop
 *   with a knee: hi and lo times 1 - I_k/(2 max(|i_x|, I_k)), and proportional to i_x below I_k
 *   upper switch open:  hi = d v_dc + drop;   lower open: lo = (1 - d) v_dc + drop;   shorted: d = 1 or 0, hi = lo = 0
 * Source   docs/theory/plant.md (PL-11) ... (PL-14), (PL-23) ... (PL-25), (PL-27), (PL-29), (PL-31)
 * Units    V, A, s
 * Rounding the polarity at a substep's end is used: first order at a zero crossing, second elsewhere
 * Context  simulation only */
#include "machine.h"

typedef struct {
    double duty[3];                    /* mean position of the leg without dead time */
    double hi_V[3], lo_V[3];           /* bounds of the leg's voltage error */
    double full_hi_V[3], full_lo_V[3]; /* the same for currents far above the knee */
    double hi_d[3], lo_d[3];           /* part of the bound that is a duty error: dead time without drop */
    double zone_A[3];                  /* below this magnitude the error is proportional to the current */
    double knee_A[3];                  /* 0: the error has no knee but that zone */
    double error_V[3];                 /* of the last substep */
    double series_V[2];                /* source behind the legs, stationary frame */
    int exact;                         /* no leg has an error */
} inverter_t;

/** Share of the period in which a leg short-circuits the dc link: one switch is shorted and the other conducts. */
double inverter_short_circuit(const plant_params_t *p, const double duty[3], int gates_on);

/** Whether the gates of a period switch: as the controller wants, or by the imposed state of the bridge (PL-31), which
 * also sets the duties. Never while the gate drivers block: no state but the first is possible then. */
int inverter_gates(const plant_params_t *p, int gates_on, double duty[3]);

/** Sets the legs for one period. */
void inverter_set(inverter_t *v, const plant_params_t *p, const double duty[3], int gates_on, double vdc_V);

/** u_s: voltage of one substep, stationary frame; i_end_dq: terminal current at its end, rotor frame. */
void inverter_voltage(inverter_t *v, const machine_t *m, double vdc_V, double h, rotation_t start, rotation_t end,
                      double u_s[2], double i_end_dq[2]);

/** Mean dc current of the substep for the given phase currents. */
double inverter_dc_current(const inverter_t *v, const double i_abc[3]);

#endif
