/* SPDX-License-Identifier: Apache-2.0 */
#ifndef PLANT_MACHINE_H
#define PLANT_MACHINE_H
/** Electrical machine: flux linkage as the state, in the stationary frame.
 *   dpsi_s/dt = u_s - R i_s,  i_m = map^-1(psi),  i = i_m + i_fe
 *   T = 1.5 p (psi_d i_qm - psi_q i_dm)
 * Source   docs/theory/plant.md (PL-4) ... (PL-10)
 * Units    SI, amplitude-invariant; _s stationary frame, _dq rotor frame
 * Rounding second order in the substep
 * Errors   a substep whose currents cannot be found (residual above 1e-10 Vs) is counted and keeps the last currents
 * Context  simulation only */
#include "plant_map.h"
#include "plant_params.h"
#include "rotor.h"

/* The perturbed flux functions (PL-4). */
typedef struct {
    const plant_map_t *map;     /* NULL: constants */
    double ld_H, lq_H;          /* constants, scales included */
    double slope, cross, q;     /* ld_slope_scale, cross - slope, lq_scale */
    double offset_Vs, psi_f_Vs; /* added to psi_d; psi_d at zero current */
} flux_model_t;

typedef struct {
    flux_model_t flux;
    double psi_nominal_Vs; /* psi_d(0, 0) of the map */
    double pole_pairs, r_ohm;
    double iron_A_per_Vs; /* i_fe = j psi times this (PL-8), (PL-28) */
    double psi_s[2];
    double psi_dq[2], im_dq[2], jac[4]; /* at the present instant; jac at the last iterate of the inversion */
    double per_det;                     /* 1/det(jac) */
    long failures;
} machine_t;

void machine_create(machine_t *m, const plant_params_t *p, const plant_map_t *map);

/** Applies changed parameters; rotor: the present angle. */
void machine_update(machine_t *m, const plant_params_t *p, rotation_t rotor, double omega_e);

void machine_set_current(machine_t *m, const double im_dq[2], rotation_t rotor);

/** Terminal current in the rotor frame at the present instant. */
static inline void machine_current(const machine_t *m, double i_dq[2])
{
    i_dq[0] = m->im_dq[0] - m->iron_A_per_Vs * m->psi_dq[1];
    i_dq[1] = m->im_dq[1] + m->iron_A_per_Vs * m->psi_dq[0];
}

/** Terminal current at the end of a substep with voltage u_s, linearised. */
void machine_predict(const machine_t *m, const double u_s[2], double h, rotation_t start, rotation_t end,
                     double i_dq[2]);

/** One substep of length h; i_mid_s: the terminal current in its middle. */
void machine_step(machine_t *m, const double u_s[2], const double i_mid_s[2], double h, rotation_t end);

static inline double machine_torque(const machine_t *m)
{
    return 1.5 * m->pole_pairs * (m->psi_dq[0] * m->im_dq[1] - m->psi_dq[1] * m->im_dq[0]);
}

#endif
