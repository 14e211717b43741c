/* SPDX-License-Identifier: Apache-2.0 */
#include "control/current_reference.h"

#include <stddef.h>

#include "fx/div.h"
#include "fx/q.h"
#include "fx/sqrt.h"

bool current_reference_valid(const current_reference_config_t *config)
{
    const fx_grid_t *grid = &config->grid;
    const bool axes = fx_axis_valid(grid->x_shift, grid->nx) && fx_axis_valid(grid->y_shift, grid->ny) &&
                      fx_axis_valid(config->torque_max.shift, config->torque_max.n);
    if (!config->i_d || !config->i_q || !config->torque_max.y || !axes || config->i_max <= 0) {
        return false;
    }
    for (size_t k = 0; k < (size_t)grid->nx * grid->ny; k++) {
        if (config->i_d[k] > 0 || config->i_q[k] < 0) {
            return false;
        }
    }
    return true;
}

/* (v_ratio v_dc - r |i|)/|w|: at low speed everything is available (CR-2). */
static q15_t available_flux(const current_reference_config_t *config, const current_reference_in_t *in)
{
    const q15_t drop = fx_mul_gain_q15(config->r_pu, in->i_magnitude);
    const q15_t voltage = fx_sub_q15(fx_mul_q15(config->v_ratio, in->v_dc), drop);
    return fx_div_q15((q15_t)fx_max_s32(voltage, 0), (q15_t)fx_max_s32(fx_abs_q15(in->omega), 1));
}

/* Interpolation between table nodes may leave the circle by a little: the d axis keeps its share (CR-7). */
static dq_t inside_circle(q15_t i_d, q15_t i_q, q15_t i_max)
{
    const int32_t room = fx_mul_q30(i_max, i_max) - fx_mul_q30(i_d, i_d);
    if (fx_mul_q30(i_q, i_q) <= room) {
        return (dq_t){i_d, i_q};
    }
    return (dq_t){(q15_t)fx_max_s32(i_d, -i_max), fx_sqrt_q30((uint32_t)fx_max_s32(room, 0))};
}

current_reference_t current_reference_step(const current_reference_config_t *config, const current_reference_in_t *in)
{
    bool flux_clamped = false;
    const q15_t psi = available_flux(config, in);
    const q15_t torque_max = fx_lookup1(&config->torque_max, psi, &flux_clamped);
    const q15_t torque = (q15_t)fx_min_s32(fx_abs_q15(in->torque), torque_max);

    const fx_cell_t cell = fx_cell(&config->grid, torque, psi);
    const q15_t i_d = (q15_t)fx_cell_interp(config->i_d, config->grid.ny, cell);
    const q15_t i_q = (q15_t)fx_cell_interp(config->i_q, config->grid.ny, cell);
    dq_t i_ref = inside_circle(i_d, i_q, config->i_max);
    i_ref.q = (in->torque < 0) ? fx_neg_q15((q15_t)i_ref.q) : i_ref.q;
    return (current_reference_t){
        .i_ref = i_ref,
        .torque_max = torque_max,
        .limited = fx_abs_q15(in->torque) > torque_max || psi < config->grid.y0,
    };
}
