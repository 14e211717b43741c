/* SPDX-License-Identifier: Apache-2.0 */
#ifndef UNIT_PLANT_PLANT_BENCH_H
#define UNIT_PLANT_PLANT_BENCH_H
/** Machines and drives shared by the tests of the simulated drive.
 * Units    SI
 * Context  tests only */
#include "plant.h"

#include <complex.h>

#define PI 3.14159265358979323846
#define TWO_PI (2.0 * PI)

/** A salient machine with constant inductances: 3 pole pairs, 20 mohm, 0.2 mH, 0.5 mH, 84 mVs; ideal inverter. */
plant_params_t bench_params(void);

/* A saturating, cross-coupled machine. Its fluxes are quadratic in each current, so that the interpolation is exact;
 * its co-energy in closed form is
 *   W' = F i_d + A i_d^2/2 - C i_d^3/3 + B i_q^2/2 - X i_d i_q^2 */
#define POLY_F 0.07
#define POLY_A 0.3e-3
#define POLY_C 4e-7
#define POLY_B 0.9e-3
#define POLY_X 3e-7
void poly_flux(double id, double iq, double psi[2]);
double poly_field_energy(double id, double iq);
plant_map_t *poly_map(void);

/** The measured map of the shipped machine, made symmetric in i_q; NULL when it cannot be read. */
plant_map_t *hsm1_map(void);

/** Duties for which an ideal inverter makes the voltage u, stationary frame. */
void bench_duty(double complex u, double vdc_V, double duty[3]);

/** Advances one period with a voltage that is u_dq in the rotor frame in the middle of the period. */
void bench_drive(plant_t *plant, double complex u_dq);

#endif
