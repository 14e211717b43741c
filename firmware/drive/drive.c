/* SPDX-License-Identifier: Apache-2.0 */
#include "drive/mrai/mrai_seam.h"

#define CIRCLE_CLEAR_Q30 1007681536 /* (31/32)^2 */

static bool modulate_valid(const modulate_config_t *c)
{
    return c->longest_q31 > Q31(0.25) && c->longest_q31 <= c->nearer_rail_q31 && c->nearer_rail_q31 <= Q31(0.5) &&
           c->dead_time_q16 >= 0 && c->dead_time_q16 < Q16(0.2) && c->knee_q17 > 0 && c->knee_q17 < (1 << 30) &&
           c->knee_side_q17 > 0 && c->knee_side_q17 < (1 << 30);
}

/* v_ratio is stored three times: itself, its inverse (Q15 * Q16 = Q31) and sqrt(3)/2 of it. 1/2 < v_ratio < 0.7. */
static bool ratio_valid(const motor_t *m)
{
    const int32_t ratio_q31 = m->modulate.alpha_q31;
    const uint32_t one_q31 = (uint32_t)(ratio_q31 >> 16) * (m->current_control.per_ratio_q31 >> 15);
    const int32_t error = m->modulate.side_q31 - fx_mul_q31(ratio_q31, Q31(0.86602540378443865));
    return ratio_q31 > Q31(0.5) && ratio_q31 < Q31(0.7) && one_q31 - 0x7FF80000U < 0x100000U && error > -16 &&
           error < 16;
}

static bool control_valid(const motor_t *m)
{
    const current_control_config_t *c = &m->current_control;
    return c->sigma_q24 > 0 && c->setpoint_weight > 0 && c->integral_gain >= 0 && c->integral_gain < Q15(0.5) &&
           c->tracking_gain_q34 >= 0 && ratio_valid(m) && m->voltage_reserve.v_ratio > 0 &&
           m->voltage_reserve.trim_min <= 0 && m->voltage_reserve.trim_max >= 0 && m->torque_loop.authority > 0 &&
           m->torque_loop.torque_min > 0 && modulate_valid(&m->modulate);
}

/* (MO-11): the largest difference between two phases is sqrt(3) v_ratio |v|; current control may limit from 31/32 on.
 * 1/v_ratio is Q15 in two factors, below 2 each. */
uint32_t motor_clear_q30(const motor_t *m, int32_t dead_time)
{
    const int32_t span = 2 * ((m->modulate.longest_q31 >> 16) - dead_time);
    const int64_t per_ratio = m->current_control.per_ratio_q31 >> 16;
    const int64_t max_q30 = (((span > 0) ? span * span / 3 : 0) * per_ratio >> 15) * per_ratio >> 15;
    return (uint32_t)((max_q30 < CIRCLE_CLEAR_Q30) ? max_q30 : CIRCLE_CLEAR_Q30);
}

static bool clear_valid(const motor_t *m)
{
    return m->current_control.clear_q30 <= motor_clear_q30(m, m->modulate.dead_time_q16 / 2);
}

/* A sample that the short check accepts must not exceed any trip level: i_normal + sum_max/3 <= i_trip. */
static bool sample_limits_valid(const monitor_config_t *c)
{
    const int32_t max = c->i_trip - c->zero_max - 1;
    return c->zero_max > 0 && 3 * c->zero_max <= c->sum_max && max >= 0 && c->i_normal_squared_q30 >= 0 &&
           c->i_normal_squared_q30 <= max * max;
}

/* (SC-10). The sums of a window fit for these periods per step. */
static bool step_valid(const bases_t *b)
{
    return b->periods_per_step >= 4U && b->periods_per_step <= 40U && b->step_s > 0.8e-3F && b->step_s < 1.25e-3F;
}

bool motor_valid(const motor_t *m)
{
    return step_valid(&m->bases) && flux_table_valid(&m->flux_table) &&
           current_reference_valid(&m->current_reference) && m->torque_max > 0 &&
           torque_limit_valid(&m->torque_limit) && m->monitor.i_trip > 0 && m->monitor.i_trip < Q15(0.8) &&
           m->monitor.v_min < m->monitor.v_max && (uint32_t)m->monitor.v_min > m->current_control.per_ratio_q31 >> 22 &&
           sample_limits_valid(&m->monitor) && m->safe_state.psi_f > 0 &&
           m->safe_state.share_open < m->safe_state.share_short && mrai_data_valid(m) && identify_valid(&m->identify) &&
           control_valid(m) && clear_valid(m);
}

void drive_init(drive_t *drive, const motor_t *source)
{
    *drive = (drive_t){.motor = *source,
                       .request = {.torque_loop = true,
                                   .identification = true,
                                   .trim = true,
                                   .identification_mode = IDENTIFICATION_ROBUST,
                                   .limits = TORQUE_LIMITS_NONE},
                       .fast.window.left = source->bases.periods_per_step,
                       .task.reference = {.torque_max = source->torque_max, .psi_plan = Q15_MAX}};
    identify_reset(&drive->motor.identify, &drive->task.identify);
    if (!motor_valid(source)) {
        drive_raise_fault(drive, FAULT_CONFIG);
    }
}

void drive_raise_fault(drive_t *drive, uint32_t fault)
{
    drive->fast.faults = drive->fast.faults | fault;
    drive->fast.is_settled = false;
}
