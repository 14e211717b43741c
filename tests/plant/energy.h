/* SPDX-License-Identifier: Apache-2.0 */
#ifndef PLANT_ENERGY_H
#define PLANT_ENERGY_H
/** Energy balance, substep by substep:
 *   dc = inverter + electrical,  electrical = copper + iron + mechanical + field
 * Source   docs/theory/plant.md (PL-20)
 * Units    J over a period; voltage and torque as integrals over time
 * Rounding each term is integrated by its own rule to second order; the balance is therefore a test, not an identity
 * Context  simulation only */
#include "machine.h"
#include "plant.h"

typedef struct {
    double psi_s[2], psi_dq[2], im_dq[2], torque_Nm;
} instant_t;

typedef struct {
    double u_dq[2], torque, torque_shaft; /* integrals over time */
    double charge;                        /* drawn from the dc link */
    double dc, electrical, copper, iron, mechanical, field;
} energy_t;

static inline instant_t energy_instant(const machine_t *m)
{
    return (instant_t){.psi_s = {m->psi_s[0], m->psi_s[1]},
                       .psi_dq = {m->psi_dq[0], m->psi_dq[1]},
                       .im_dq = {m->im_dq[0], m->im_dq[1]},
                       .torque_Nm = machine_torque(m)};
}

/** Adds a substep of length h from one instant to the other, with its mid-point current i_s. */
void energy_electric(energy_t *e, const machine_t *m, const instant_t *from, const instant_t *to, const double u_s[2],
                     const double i_s[2], double h);

/** The mechanical part: mean torque of the substep, speed in its middle. */
void energy_mechanic(energy_t *e, double torque_Nm, double speed_rad_s, double friction_Nm, double h);

/** Adds u_s, which is constant, as seen from the rotor, which turns by 2 half_rad in the substep. */
void energy_voltage(energy_t *e, const double u_s[2], rotation_t mid, double half_rad, double h);

/** Mean values of a period, and its energies added to those since the start. */
void energy_mean(const energy_t *sum, double period_s, plant_truth_t *t);

#endif
