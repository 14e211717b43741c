/* SPDX-License-Identifier: Apache-2.0 */
#ifndef PLANT_INVERTER_H
#define PLANT_INVERTER_H
/** Two-level inverter, averaged over the PWM period. All legs have the same characteristic, similar to dry friction:
 *   v_x = v_dc d_x - e_x,  e_x = hi_x for i_x > 0, -lo_x for i_x < 0, between: the value that holds i_x at 0
 *   switching:  hi, lo = dead-time loss + drop;   gates off:  d = 1/2, hi = lo = v_dc/2 + drop
 *   upper switch open:  hi = d v_dc + drop;   lower: lo = (1 - d) v_dc + drop;   shorted: d = 1 or 0, hi = lo = 0
 * Source   docs/theory/plant.md (PL-11) ... (PL-14), (PL-23) ... (PL-25)
 * Units    V, A, s
 * Rounding polarity is taken at a substep's end: first order at a zero crossing, second elsewhere
 * Context  simulation only */
#include "machine.h"

typedef struct {
    double duty[3];          /* mean position of the leg without dead time */
    double hi_V[3], lo_V[3]; /* bounds of the leg's voltage error */
    double hi_d[3], lo_d[3]; /* the part of it that is a duty error: dead time, not drop */
    double zone_A[3];        /* the error is proportional to the current inside */
    double error_V[3];       /* of the last substep */
    int exact;               /* no leg has an error */
} inverter_t;

/** Share of the period in which a switch that is switched on meets a shorted one: the dc link's short circuit. */
double inverter_short_circuit(const plant_params_t *p, const double duty[3], int gates_on);

/** The legs of one period. */
void inverter_set(inverter_t *v, const plant_params_t *p, const double duty[3], int gates_on, double vdc_V);

/** Voltage of one substep (stationary frame), terminal current at its end (rotor frame). */
void inverter_voltage(inverter_t *v, const machine_t *m, double vdc_V, double h, turn_t start, turn_t end,
                      double u_s[2], double i_end_dq[2]);

/** Mean dc current of the substep for the given phase currents. */
double inverter_dc_current(const inverter_t *v, const double i_abc[3]);

#endif
