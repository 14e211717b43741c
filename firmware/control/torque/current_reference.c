/* SPDX-License-Identifier: Apache-2.0 */
#include "control/torque/current_reference.h"

#include <stddef.h>

#include "fx/codegen.h"
#include "fx/div.h"
#include "fx/q.h"
#include "fx/vec.h"

motor_check_t current_reference_check(const current_reference_config_t *config)
{
    const fx_grid_t *grid = &config->grid;
    if (!config->i_d || !config->i_q || !config->torque_max.y) {
        return MOTOR_CHECK_REFERENCE_TABLE_MISSING;
    }
    if (!fx_axis_valid(grid->x_shift, grid->nx) || !fx_axis_valid(grid->y_shift, grid->ny) ||
        !fx_axis_valid(config->torque_max.shift, config->torque_max.n)) {
        return MOTOR_CHECK_REFERENCE_TABLE_GRID;
    }
    for (size_t k = 0; k < (size_t)grid->nx * grid->ny; k++) {
        if (config->i_d[k] > 0 || config->i_q[k] < 0) {
            return MOTOR_CHECK_REFERENCE_TABLE_VALUE;
        }
    }
    return (config->i_max > 0) ? MOTOR_CHECK_OK : MOTOR_CHECK_CURRENT_MAX;
}

/* (v_ratio v_dc - r |i| + v_trim)/|w| - shift (CR-2), (CR-9). The quotient may reach 2^30, so that the shift has no
 * effect at low speed, where the voltage does not limit the flux. */
static int32_t planned_flux(const current_reference_config_t *config, const current_reference_in_t *in)
{
    const int32_t drop = fx_mul_gain_q15_word(config->r_pu, in->i_magnitude);
    const int32_t voltage = fx_mul_q15(config->v_ratio, in->v_dc) - drop + in->v_trim;
    const int32_t flux = fx_usat_q15_word(voltage) * 32768 / fx_max_s32(fx_abs_q15(in->omega), 1);
    return fx_max_s32(flux - in->shift, 0);
}

/* Interpolation between table nodes may slightly exceed the current circle: i_d is kept and i_q reduced (CR-7). */
static dq_q15_t limit_to_current_circle(dq_q15_t i, q15_t i_max)
{
    const int32_t i_q_squared_max = fx_mul_q30(i_max, i_max) - fx_mul_q30((q15_t)i.d, (q15_t)i.d);
    if (fx_mul_q30((q15_t)i.q, (q15_t)i.q) <= i_q_squared_max) {
        return i;
    }
    return (dq_q15_t){fx_max_s32(i.d, -i_max), fx_leg(i_max, i.d)};
}

static FX_NOT_INLINED dq_q15_t currents_from_table(const current_reference_config_t *config, int32_t torque,
                                                   int32_t psi)
{
    const fx_cell_t cell = fx_cell(&config->grid, torque, psi);
    return (dq_q15_t){fx_cell_interp(config->i_d, config->grid.ny, cell),
                      fx_cell_interp(config->i_q, config->grid.ny, cell)};
}

static FX_NOT_INLINED int32_t torque_max_from_table(const current_reference_config_t *config, int32_t psi)
{
    bool clamped = false;
    return fx_lookup1(&config->torque_max, psi, &clamped);
}

/* t_max + dpsi_d i_q - dpsi_q i_d at the currents of t_max: the tables' torque corrected by the identified flux
 * (CR-10). Only a negative shift is used. A positive one means that a weak magnet leaves additional flux at the present
 * point; at the largest torque, where psi_d is small, it need not. */
static q15_t torque_max_identified(const current_reference_config_t *config, const current_reference_in_t *in,
                                   int32_t planned)
{
    const int32_t psi = fx_sat_q15_word(planned + fx_min_s32(in->shift, 0));
    const int32_t torque_max = torque_max_from_table(config, psi);
    const dq_q15_t i = currents_from_table(config, torque_max, psi);
    const int32_t identified = fx_mul_q15(in->psi_d_error, i.q) - fx_mul_q15(in->psi_q_delta, i.d);
    return (q15_t)fx_usat_q15_word(torque_max + identified);
}

current_reference_t current_reference_step(const current_reference_config_t *config, const current_reference_in_t *in)
{
    const int32_t planned = planned_flux(config, in);
    const int32_t psi = fx_sat_q15_word(planned);
    const int32_t torque = fx_abs_q15(in->torque_corrected);
    const int32_t torque_max = torque_max_from_table(config, psi);

    dq_q15_t i_ref = limit_to_current_circle(currents_from_table(config, fx_min_s32(torque, torque_max), psi),
                                             config->i_max);
    const bool i_d_limited = i_ref.d < -in->i_d_max;
    i_ref.d = fx_max_s32(i_ref.d, -in->i_d_max); /* (CR-11) */
    i_ref.q = (in->torque_corrected < 0) ? -i_ref.q : i_ref.q;
    return (current_reference_t){
        .i_ref = i_ref,
        .torque_max = torque_max_identified(config, in, planned),
        .psi_plan = (q15_t)psi,
        .limited = torque > torque_max || psi < config->grid.y0,
        .i_d_limited = i_d_limited,
    };
}
