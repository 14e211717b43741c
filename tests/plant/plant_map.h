/* SPDX-License-Identifier: Apache-2.0 */
#ifndef PLANT_PLANT_MAP_H
#define PLANT_PLANT_MAP_H
/** Flux map of a saturated machine: bicubic Hermite interpolation of psi_d, psi_q over (i_d, i_q).
 *   Continuous with its first derivatives. Outside the grid the slopes of the edge change gradually to constant ones
 *   without cross coupling.
 * Source   docs/theory/plant.md (PL-1) ... (PL-3)
 * Units    A, Vs, H; amplitude-invariant dq frame
 * Range    every current; the inversion is unique where both incremental inductances and the determinant of their
 *          matrix are positive. This is checked over the grid, and the extrapolation is chosen to keep it
 * Errors   create returns NULL, invert returns non-zero when the residual stays above 1e-10 Vs
 * Context  simulation only; a map is constant after creation and may be shared by many plants */

typedef struct plant_map plant_map_t;

/** Full plane, row-major [i_d][i_q], at least 2 x 2, axes strictly increasing. Copies the data.
 * NULL: bad size, a non-monotone axis, a non-finite number, a singular incremental inductance. */
plant_map_t *plant_map_create(const double *id_A, int nd, const double *iq_A, int nq, const double *psi_d_Vs,
                              const double *psi_q_Vs);
void plant_map_destroy(plant_map_t *map);

/** jac = {dpsi_d/di_d, dpsi_d/di_q, dpsi_q/di_d, dpsi_q/di_q}; may be NULL. */
void plant_map_flux(const plant_map_t *map, double id_A, double iq_A, double *psi_d_Vs, double *psi_q_Vs,
                    double jac[4]);

/** psi_d(0, i_q) and its slope; needs less computation than plant_map_flux(). */
double plant_map_axis_flux(const plant_map_t *map, double iq_A, double *slope_H);

/** Both at i = {i_d, i_q}: psi and jac as of plant_map_flux(), psi_d(0, i_q) with its slope returned. */
double plant_map_both(const plant_map_t *map, const double i[2], double psi[2], double jac[4], double *slope_H);

/** Newton's method with step halving, from the given currents (any start) to 1e-10 Vs. Returns 0, or -1 on failure. */
int plant_map_invert(const plant_map_t *map, double psi_d_Vs, double psi_q_Vs, double *id_A, double *iq_A);

#endif
