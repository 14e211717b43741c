/* SPDX-License-Identifier: Apache-2.0 */
#ifndef PLANT_FLUX_SOLVE_H
#define PLANT_FLUX_SOLVE_H
/** Currents of a given flux linkage, by Newton's method with step halving.
 *   i <- i + s J^-1 (psi - psi(i)),  s = 1, 1/2, 1/4 ... until the residual shrinks
 * Source   docs/theory/plant.md (PL-3)
 * Units    A, Vs, H
 * Errors   -1 when no step shrinks the residual below FLUX_SOLVE_TOLERANCE_VS; i is the best found
 * Context  simulation only */
#include <stddef.h>

#define FLUX_SOLVE_TOLERANCE_VS 1e-10

/* jac row-major, never NULL. */
typedef void flux_fn_t(const void *model, const double i[2], double psi[2], double jac[4]);

/** i: start value in, solution out; jac: incremental inductances at the solution. */
int flux_solve(flux_fn_t *flux, const void *model, const double psi[2], double i[2], double jac[4]);

static inline double flux_per_det(const double jac[4])
{
    return 1.0 / (jac[0] * jac[3] - jac[1] * jac[2]);
}

/** x = J^-1 r, with the determinant's inverse known: a division takes as long as all the rest. */
static inline void flux_solve_step(const double jac[4], double per_det, const double r[2], double x[2])
{
    x[0] = (jac[3] * r[0] - jac[1] * r[1]) * per_det;
    x[1] = (jac[0] * r[1] - jac[2] * r[0]) * per_det;
}

/** x = J^-1 r. */
static inline void flux_divide(const double jac[4], const double r[2], double x[2])
{
    flux_solve_step(jac, flux_per_det(jac), r, x);
}

#endif
