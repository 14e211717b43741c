/* SPDX-License-Identifier: Apache-2.0 */
#include "control/torque/current_reference.h"

#include <stddef.h>

#include "fx/codegen.h"
#include "fx/div.h"
#include "fx/q.h"
#include "fx/vec.h"

#define LIMIT_SHIFT 2 /* (CR-16) */

motor_check_t current_reference_check(const current_reference_config_t *config)
{
    const fx_grid_t *grid = &config->grid;
    if (!config->i_d || !config->i_q || !config->torque_max) {
        return MOTOR_CHECK_REFERENCE_TABLE_MISSING;
    }
    if (!fx_axis_valid(grid->x_shift, grid->nx) || !fx_axis_valid(grid->y_shift, grid->ny)) {
        return MOTOR_CHECK_REFERENCE_TABLE_GRID;
    }
    for (size_t k = 0; k < (size_t)grid->nx * grid->ny; k++) {
        if (config->i_d[k] > 0 || config->i_q[k] < 0) {
            return MOTOR_CHECK_REFERENCE_TABLE_VALUE;
        }
    }
    return (config->i_max > 0) ? MOTOR_CHECK_OK : MOTOR_CHECK_CURRENT_MAX;
}

/* sqrt(v_plan^2 - 2 r |w| torque)/|w| - shift (CR-2), (CR-9), with torque_limit where torque is larger: no more than
 * the reach is made. The quotient may reach 2^30, so that the shift has no effect at low speed, where the voltage does
 * not limit the flux. */
static FX_NOT_INLINED int32_t planned_flux(const current_reference_config_t *config, const current_reference_in_t *in,
                                           int32_t torque)
{
    const int32_t speed = fx_max_s32(fx_abs_q15(in->omega), 1);
    const int32_t v_plan = fx_usat_q15_word(in->v_plan);
    const bool brakes = in->torque_corrected * in->omega < 0;
    const int32_t driving = brakes ? 0 : fx_min_s32(torque, in->torque_limit);
    /* Q30, below 2^31 for every resistance, speed and torque */
    const int32_t drop = 2 * fx_mulhi((int32_t)config->r_q16 * speed, driving * 65536);
    const int32_t flux = fx_root((uint32_t)fx_max_s32(v_plan * v_plan - drop, 0)) * 32768 / speed;
    return flux - in->shift;
}

/* Interpolation between table nodes may slightly exceed the current circle: i_d is kept and i_q reduced (CR-7). */
static dq_q15_t limit_to_current_circle(dq_q15_t i, q15_t i_max)
{
    const int32_t i_q_squared_max = fx_mul_q30(i_max, i_max) - fx_mul_q30((q15_t)i.d, (q15_t)i.d);
    if (fx_mul_q30((q15_t)i.q, (q15_t)i.q) <= i_q_squared_max) {
        return i;
    }
    return (dq_q15_t){fx_max_s32(i.d, -i_max), fx_root((uint32_t)fx_max_s32(i_q_squared_max, 0))};
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
    const fx_lut1_t over_psi = {config->torque_max, config->grid.y0, config->grid.y_shift, config->grid.ny};
    bool clamped = false;
    return fx_lookup1(&over_psi, psi, &clamped);
}

/* t_max + dpsi_d i_q - dpsi_q i_d at the currents of t_max: the tables' torque corrected by the identified flux
 * (CR-10). A negative shift is taken back: a weak magnet leaves additional flux at the present point; at the largest
 * torque, where psi_d is small, it need not. */
static q15_t torque_max_identified(const current_reference_config_t *config, const current_reference_in_t *in,
                                   int32_t planned)
{
    const int32_t psi = fx_usat_q15_word(planned + fx_min_s32(in->shift, 0));
    const int32_t torque_max = torque_max_from_table(config, psi);
    const dq_q15_t i = currents_from_table(config, torque_max, psi);
    const int32_t identified = fx_mul_q15(in->psi_d_error, i.q) - fx_mul_q15(in->psi_q_delta, i.d);
    return (q15_t)fx_usat_q15_word(torque_max + identified);
}

/* The largest torque reduces the flux that allows it. Slow steps towards it converge where the two depend strongly on
 * each other (CR-16). */
static q15_t towards(int32_t torque_limit, int32_t torque_max)
{
    return (q15_t)(torque_limit + ((torque_max - torque_limit) >> LIMIT_SHIFT));
}

current_reference_t current_reference_step(const current_reference_config_t *config, const current_reference_in_t *in)
{
    const int32_t planned_max = planned_flux(config, in, in->torque_limit);
    const int32_t torque_max = torque_max_from_table(config, fx_usat_q15_word(planned_max));
    const q15_t torque_max_reported = torque_max_identified(config, in, planned_max);

    const int32_t requested = fx_abs_q15(in->torque_corrected);
    const q15_t psi = (q15_t)fx_usat_q15_word(planned_flux(config, in, requested));
    const int32_t torque = fx_min_s32(requested, torque_max);
    dq_q15_t i_ref = limit_to_current_circle(currents_from_table(config, torque, psi), config->i_max);
    const bool i_d_limited = i_ref.d < -in->i_d_max;
    i_ref.d = fx_max_s32(i_ref.d, -in->i_d_max); /* (CR-11) */
    i_ref.q = (in->torque_corrected < 0) ? -i_ref.q : i_ref.q;
    return (current_reference_t){
        .i_ref = i_ref,
        .torque_max = torque_max_reported,
        .torque_limit = towards(in->torque_limit, torque_max_reported),
        .psi_plan = psi,
        .limited = requested > torque_max || psi < config->grid.y0,
        .i_d_limited = i_d_limited,
    };
}
