/* SPDX-License-Identifier: Apache-2.0 */
#ifndef PLANT_PLANT_H
#define PLANT_PLANT_H
/** The simulated traction drive: inverter, machine, mechanics, sensors; the reference of every closed-loop test.
 *   dpsi_s/dt = u_s - R i_s,  i = map^-1(psi),  T = 1.5 p (psi_d i_q - psi_q i_d)
 * Source   docs/theory/plant.md (PL-1) ... (PL-31)
 * Units    SI; phase peak quantities, amplitude-invariant dq frame, motor convention
 * Errors   plant_create() returns NULL for bad parameters or no memory
 * Context  simulation only, double precision; one instance per drive, no global state.
 *          One period: plant_sample() at its start, then plant_advance() with the duties that
 *          act in it. The computation delay belongs to the caller. */
#include <stdint.h>

#include "dc_link.h"
#include "plant_map.h"
#include "plant_params.h"

typedef struct plant plant_t;

typedef struct {
    double ia_A, ib_A, ic_A; /* measured: with gain, offset and noise, saturated and quantised */
    int32_t i_count[3];      /* converter counts, mid-scale is zero current */
    double vdc_V;
    int32_t vdc_count;
    double theta_m_rad; /* [0, 2 pi) */
    int32_t theta_count;
    double known_share; /* what the converter reads of a voltage that does not come from its reference; 1: right */
    double t_winding_C;
    int gate_fault; /* the gate drivers blocked a short circuit in the last period, or block now (drivers_block) */
} plant_sensors_t;

typedef struct {
    double time_s;
    /* at this instant */
    double i_d_A, i_q_A, i_abc_A[3]; /* terminal currents */
    double i_dm_A, i_qm_A;           /* magnetising currents: terminal current minus iron-loss current */
    double psi_d_Vs, psi_q_Vs;
    double torque_Nm; /* air gap */
    double speed_rad_s, speed_rpm, theta_m_rad, theta_e_rad;
    double r_ohm, psi_f_Vs, vdc_V;
    long inversion_failures; /* substeps whose currents were not found within the tolerance; a valid run has 0 */
    /* mean over the last period */
    double u_d_V, u_q_V;                         /* terminal voltage in the rotor frame */
    double torque_mean_Nm, torque_shaft_mean_Nm; /* shaft: minus the friction */
    double idc_A;
    double copper_W, iron_W, mechanical_W, electrical_W, inverter_W;
    /* integrals since creation or plant_set_state() */
    double e_dc_J, e_electrical_J, e_copper_J, e_iron_J, e_mechanical_J;
    double e_field_J;         /* 1.5 integral of i . dpsi in the rotor frame */
    double e_avalanche_J;     /* dissipated by the bridge's semiconductors above avalanche_V */
    double e_short_circuit_J; /* drawn from the dc link by a leg whose two switches conduct */
    double gate_supply;       /* 1: the gates have their supply */
} plant_truth_t;

/** The map is borrowed and must outlive the plant; NULL: ld_H, lq_H, psi_f_Vs are used.
 * Starts with magnetising current 0. NULL: bad parameters or no memory. */
plant_t *plant_create(const plant_params_t *params, const plant_map_t *map);
void plant_destroy(plant_t *plant);

/** The parameters in use: a change takes effect at the next plant_sample() or plant_advance(). */
plant_params_t *plant_params(plant_t *plant);

/** Puts the machine into a given state (magnetising currents; an imposed speed becomes this one)
 * and clears the energy integrals; time is not reset. */
void plant_set_state(plant_t *plant, double id_A, double iq_A, double theta_m_rad, double speed_rad_s);

void plant_sample(plant_t *plant, plant_sensors_t *sensors);

/** Sets the board's switches; at creation the battery is connected and the gates have their supply. Without effect
 * while a state of the bridge is imposed. */
void plant_switch(plant_t *plant, const plant_switches_t *on);

/** One PWM period; wanted: duties 0..1 (clamped, NaN counts as 0.5). Only the diodes conduct while switching is
 * disabled, while the gates have no supply, and in a period in which the gate drivers block. */
void plant_advance(plant_t *plant, const double wanted[3], int gates_on);

const plant_truth_t *plant_truth(const plant_t *plant);

#endif
