/* SPDX-License-Identifier: Apache-2.0 */
#include "drive/gain_jump_check.h"

/* The part of the voltage of i* that a quarter of it makes, with the tables' flux. */
static dq_q15_t voltage_per_quarter(const drive_t *drive, q15_t omega, winding_resistance_t r)
{
    const task_state_t *task = &drive->task;
    const dq_q15_t quarter = {task->i_ref.d >> 2, task->i_ref.q >> 2};
    const dq_q15_t less = {task->i_ref.d - quarter.d, task->i_ref.q - quarter.q};
    const flux_point_t flux = flux_table_step(&drive->motor->flux_table, less);
    return (dq_q15_t){
        fx_mul_gain_q15_word(r.r, quarter.d) - fx_mul_q15(omega, task->psi_ref.q - flux.psi_q),
        fx_mul_gain_q15_word(r.r, quarter.q) + fx_mul_q15(omega, task->psi_ref.d - flux.psi_d),
    };
}

uint32_t gain_jump_check(drive_t *drive, const snapshot_t *snapshot, bool comparable, winding_resistance_t r)
{
    task_state_t *task = &drive->task;
    const torque_monitor_config_t *config = &drive->motor->torque_monitor;
    const torque_monitor_state_t *monitor = &task->torque_monitor;
    if (!comparable || monitor->settling < config->settle_steps) {
        task->gain_jump.steps = 0;
        return 0;
    }
    const fx_pair_t i_ref = fx_pair(task->i_ref.d, task->i_ref.q);
    const gain_jump_in_t in = {
        .residual = monitor->residual,
        .i_ref = i_ref,
        .i_excess = fx_pair_sub(fx_pair(snapshot->i_mean.d, snapshot->i_mean.q), i_ref),
        .omega = fx_q15_from_q31(snapshot->sample.point.omega),
        .current = snapshot->i_magnitude,
    };
    const bool found = gain_jump_step(config, &task->gain_jump, &in) &&
                       gain_jump_is_found(config, &task->gain_jump, voltage_per_quarter(drive, in.omega, r));
    return found ? (uint32_t)FAULT_INPUT : 0U;
}
