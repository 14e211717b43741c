/* SPDX-License-Identifier: Apache-2.0 */
#include "app/drive.h"

static bool modulate_valid(const modulate_config_t *c)
{
    return c->v_dc_min > 1 && c->knee_q17 > 0 && c->knee_q17 < (1 << 30) && c->knee_side_q17 > 0 &&
           c->knee_side_q17 < (1 << 30);
}

static bool control_valid(const motor_t *m)
{
    const current_control_config_t *c = &m->current_control;
    return c->sigma_q24 > 0 && c->setpoint_weight > 0 && c->integral_gain >= 0 && c->integral_gain < Q15(0.5) &&
           c->tracking_gain >= 0 && c->tracking_gain < Q15(0.5) && c->v_ratio > 0 && c->v_ratio < Q15(0.7) &&
           m->voltage_reserve.v_ratio > 0 && m->voltage_reserve.trim_min <= 0 && m->voltage_reserve.trim_max >= 0 &&
           m->torque_loop.authority > 0 && m->torque_loop.torque_min > 0 && modulate_valid(&m->modulate);
}

/* (MO-11): the largest distance of two phases is sqrt(3) |u|/v_dc; the d axis alone may take 31/32 of the circle. */
static bool clear_valid(const motor_t *m)
{
    const int32_t ratio = m->current_control.v_ratio - m->current_control.v_ratio / 32;
    const int32_t span = 32768 - 2 * (m->modulate.min_pulse + m->modulate.dead_time);
    const int64_t clear_q30 = m->current_control.clear_q32 / 4;
    return m->current_control.clear_q32 >= 0 && span > 0 && clear_q30 <= ratio * ratio &&
           3 * clear_q30 <= (int64_t)span * span;
}

/* The quick look may miss nothing: sqrt(quiet) + sum_max/3 <= i_trip. */
static bool quiet_valid(const monitor_config_t *c)
{
    const int32_t most = c->i_trip - (c->sum_max + 2) / 3;
    return c->quiet_q30 >= 0 && most >= 0 && c->quiet_q30 <= most * most;
}

bool motor_valid(const motor_t *m)
{
    return flux_table_valid(&m->flux_table) && current_reference_valid(&m->current_reference) && m->torque_max > 0 &&
           torque_limit_valid(&m->torque_limit) &&
           m->monitor.i_trip > 0 && m->monitor.i_trip < Q15(0.8) && m->monitor.v_min < m->monitor.v_max &&
           m->monitor.sum_max > 0 && quiet_valid(&m->monitor) && m->safe_state.psi_f > 0 &&
           m->safe_state.share_open < m->safe_state.share_short && mrai_valid(&m->mrai) &&
           identify_valid(&m->identify) && control_valid(m) && clear_valid(m);
}

void drive_init(drive_t *drive, const motor_t *source)
{
    *drive = (drive_t){.motor = *source,
                       .request = {.torque_loop = true,
                                   .identification = true,
                                   .trim = true,
                                   .identification_mode = IDENTIFICATION_ROBUST,
                                   .limits = TORQUE_LIMITS_NONE},
                       .task.reference = {.torque_max = source->torque_max, .psi_plan = Q15_MAX}};
    identify_reset(&drive->motor.identify, &drive->task.identify);
    if (!motor_valid(source)) {
        drive_raise_fault(drive, FAULT_CONFIG);
    }
}

void drive_raise_fault(drive_t *drive, uint32_t fault)
{
    drive->fast.faults = drive->fast.faults | fault;
    drive->fast.settled = false;
}
