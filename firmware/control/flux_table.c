/* SPDX-License-Identifier: Apache-2.0 */
#include "control/flux_table.h"

#include <stddef.h>

#include "fx/q.h"

bool flux_table_valid(const flux_table_config_t *config)
{
    const fx_grid_t *grid = &config->grid;
    const bool tables = config->l_d && config->l_q && config->l_qq && config->g_d && config->g_q && config->psi_f0;
    if (!tables || grid->nx < 2 || grid->ny < 2 || grid->y0 != 0 || config->l_shift > 14) {
        return false;
    }
    for (size_t k = 0; k < (size_t)grid->nx * grid->ny; k++) {
        if (config->l_q[k] <= 0 || config->l_qq[k] <= 0 || config->g_d[k] <= 0 || config->g_q[k] <= 0) {
            return false;
        }
    }
    return true;
}

/* l i with l stored as l / 2^l_shift: Q15 * Q15 = Q30, narrowed with the shift folded in. */
static int32_t flux_of(q15_t l, q15_t i, uint8_t l_shift)
{
    return fx_shr_round(fx_mul_q30(l, i), 15U - l_shift);
}

flux_point_t flux_table_step(const flux_table_config_t *config, dq_t i)
{
    const fx_cell_t cell = fx_cell(&config->grid, i.d, fx_abs_q15(i.q));
    const uint32_t ny = config->grid.ny;
    flux_point_t out = {
        .l_d = (q15_t)fx_cell_interp(config->l_d, ny, cell),
        .l_q = (q15_t)fx_cell_interp(config->l_q, ny, cell),
        .l_qq = (q15_t)fx_cell_interp(config->l_qq, ny, cell),
        .g_d = (q15_t)fx_cell_interp(config->g_d, ny, cell),
        .g_q = (q15_t)fx_cell_interp(config->g_q, ny, cell),
        .psi_f0 = (q15_t)fx_cell_interp(config->psi_f0, ny, cell),
        .clamped = cell.clamped,
    };
    out.psi_d = fx_sat_q15(out.psi_f0 + flux_of(out.l_d, i.d, config->l_shift));
    out.psi_q = fx_sat_q15(flux_of(out.l_q, i.q, config->l_shift));
    return out;
}
