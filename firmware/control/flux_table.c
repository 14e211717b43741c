/* SPDX-License-Identifier: Apache-2.0 */
#include "control/flux_table.h"

#include <stddef.h>

#include "fx/q.h"

bool flux_table_valid(const flux_table_config_t *config)
{
    const bool tables = config->l_d && config->l_q && config->l_qq && config->g_d && config->g_q && config->psi_f0;
    if (!tables || !fx_mesh_valid(&config->mesh) || config->l_shift > 13) {
        return false;
    }
    const size_t nodes = (size_t)((config->mesh.x_last >> 14) + 2U) * config->mesh.ny;
    for (size_t k = 0; k < nodes; k++) {
        if (config->l_q[k] <= 0 || config->l_qq[k] <= 0 || config->g_d[k] <= 0 || config->g_q[k] <= 0) {
            return false;
        }
    }
    return true;
}

flux_point_t flux_table_step(const flux_table_config_t *config, dq_t i)
{
    const uint32_t ny = config->mesh.ny;
    const uint32_t magnitude = (uint32_t)((i.q < 0) ? -i.q : i.q);
    const fx_cell_t cell = fx_mesh_cell(&config->mesh, i.d, magnitude);
    const int32_t l_d = fx_cell_interp(config->l_d, ny, cell);
    const int32_t l_q = fx_cell_interp(config->l_q, ny, cell);
    const int32_t psi_f0 = fx_cell_interp_y(config->psi_f0, cell);
    /* l is stored as l / 2^l_shift: Q15 * Q15 = Q30, * 2^(17 + l_shift), high word: Q15. */
    const int32_t scale = (int32_t)(UINT32_C(0x20000) << config->l_shift);
    return (flux_point_t){
        .l_d = l_d,
        .l_q = l_q,
        .l_qq = fx_cell_interp(config->l_qq, ny, cell),
        .g_d = fx_cell_interp(config->g_d, ny, cell),
        .g_q = fx_cell_interp(config->g_q, ny, cell),
        .psi_f0 = psi_f0,
        .psi_d = fx_sat_q15_word(fx_mulhi_add(psi_f0, l_d * i.d, scale)),
        .psi_q = fx_sat_q15_word(fx_mulhi(l_q * i.q, scale)),
        .clamped = cell.clamped,
    };
}
