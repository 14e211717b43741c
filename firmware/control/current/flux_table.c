/* SPDX-License-Identifier: Apache-2.0 */
#include "control/current/flux_table.h"

#include <stddef.h>

#include "fx/codegen.h"
#include "fx/q.h"

FX_COLD motor_check_t flux_table_check(const flux_table_config_t *config)
{
    if (!config->l_d || !config->l_q || !config->l_qq || !config->g || !config->psi_f0) {
        return MOTOR_CHECK_FLUX_TABLE_MISSING;
    }
    if (!fx_mesh_valid(&config->mesh) || config->l_shift > 13U || config->i_scale != 8 << config->l_shift) {
        return MOTOR_CHECK_FLUX_TABLE_GRID;
    }
    const size_t nodes = (size_t)((config->mesh.x_last >> 14) + 2U) * config->mesh.ny;
    for (size_t k = 0; k < nodes; k++) {
        if (config->l_q[k] <= 0 || config->l_qq[k] <= 0 || config->g[k] <= 0) {
            return MOTOR_CHECK_FLUX_TABLE_VALUE;
        }
    }
    return MOTOR_CHECK_OK;
}

static fx_cell_t cell_of(const flux_table_config_t *config, dq_q15_t i)
{
    return fx_mesh_cell(&config->mesh, i.d, (uint32_t)((i.q < 0) ? -i.q : i.q));
}

/* l in Q29 times i 2^(3 + l_shift), high word: Q15. */
flux_point_t flux_table_step(const flux_table_config_t *config, dq_q15_t i)
{
    const fx_cell_t cell = cell_of(config, i);
    const uint32_t ny = config->mesh.ny;
    const int32_t psi_f0 = fx_cell_interp_y(config->psi_f0, cell);
    const int32_t g = fx_cell_interp(config->g, ny, cell);
    const int32_t i_scale = config->i_scale;
    const int32_t psi_d = fx_mulhi_add(psi_f0, fx_cell_sum(config->l_d, ny, cell), i.d * i_scale);
    const int32_t psi_q = fx_mulhi(fx_cell_sum(config->l_q, ny, cell), i.q * i_scale);
    return (flux_point_t){
        .psi_d = fx_sat_q15_word(psi_d),
        .psi_q = fx_sat_q15_word(psi_q),
        .psi_f0 = psi_f0,
        .g = g,
    };
}

FX_COLD flux_inductances_t flux_table_inductances(const flux_table_config_t *config, dq_q15_t i)
{
    const fx_cell_t cell = cell_of(config, i);
    const uint32_t ny = config->mesh.ny;
    return (flux_inductances_t){fx_cell_interp(config->l_d, ny, cell), fx_cell_interp(config->l_qq, ny, cell)};
}
