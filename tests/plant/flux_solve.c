/* SPDX-License-Identifier: Apache-2.0 */
#include "flux_solve.h"

#include <math.h>
#include <string.h>

static double residual_norm(flux_fn_t *flux, const void *model, const double psi[2], const double i[2], double r[2],
                            double jac[4])
{
    flux(model, i, r, jac);
    r[0] = psi[0] - r[0];
    r[1] = psi[1] - r[1];
    return hypot(r[0], r[1]);
}

int flux_solve(flux_fn_t *flux, const void *model, const double psi[2], double i[2], double jac[4])
{
    double r[2];
    double best = residual_norm(flux, model, psi, i, r, jac);
    for (int n = 0; n < 100 && best > FLUX_SOLVE_TOLERANCE_VS; n++) {
        double step[2], trial[2], trial_r[2], trial_jac[4], size = 2.0, norm;
        flux_divide(jac, r, step);
        do {
            size *= 0.5;
            trial[0] = i[0] + size * step[0];
            trial[1] = i[1] + size * step[1];
            norm = residual_norm(flux, model, psi, trial, trial_r, trial_jac);
        } while (!(norm < best * (1.0 - 0.1 * size)) && size > 1e-6);
        if (!(norm < best)) {
            return -1;
        }
        best = norm;
        memcpy(i, trial, sizeof trial);
        memcpy(r, trial_r, sizeof r);
        memcpy(jac, trial_jac, sizeof trial_jac);
    }
    return best <= FLUX_SOLVE_TOLERANCE_VS ? 0 : -1;
}
