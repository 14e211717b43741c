/* SPDX-License-Identifier: Apache-2.0 */
#include "drive/data_check.h"
#include "drive/drive.h"
#include "drive/excess_torque.h"
#include "drive/iron_current.h"
#include "drive/mrai/mrai_seam.h"
#include "drive/safe_decision.h"
#include "drive/slow_monitors.h"
#include "drive/step_mean.h"
#include "drive/switch_off.h"
#include "drive/tracked_speed.h"
#include "fx/vec.h"
#include "hal/adc.h"
#include "hal/angle.h"
#include "hal/pwm.h"
#include "hal/temperature.h"
#include "signal/program_flow.h"
#include "signal/rate_limit.h"

static void take_resets(drive_t *drive, bool enable)
{
    const request_t *request = &drive->request;
    task_state_t *task = &drive->task;
    if (request->fault_resets != task->fault_resets_asked) {
        task->fault_resets_asked = request->fault_resets; /* a reset while running is refused for good */
        task->fault_resets += (enable || switch_off_holds(drive)) ? 0U : 1U;
    }
    if (request->identification_resets != task->identification_resets) {
        task->identification_resets = request->identification_resets;
        mrai_discard(drive);
        drive_reset_identification(drive);
        drive_restore_trim(drive, 0);
    }
}

static run_state_t next_run_state(drive_t *drive, const snapshot_t *snapshot)
{
    const bool enable = drive->request.enable; /* read once: a reset is never sent together with the command to run */
    take_resets(drive, enable);
    if (snapshot->faults != 0U) {
        return RUN_STATE_FAULT;
    }
    return (enable && switch_off_may_switch(drive, snapshot)) ? RUN_STATE_RUN : RUN_STATE_OFF;
}

/* Compares the acting voltage with the plan of the last step. */
static voltage_reserve_t update_voltage_reserve(drive_t *drive, const snapshot_t *snapshot)
{
    task_state_t *task = &drive->task;
    const voltage_reserve_in_t in = {
        .u = fx_magnitude(snapshot->u_mean.d, snapshot->u_mean.q),
        .v_dc = (q15_t)snapshot->sample.v_dc,
        .psi = task->psi_ref,
        .psi_plan = task->reference.psi_plan,
        .psi_d_error = snapshot->psi_d_error,
        .acting = snapshot->sample.acting && !drive_bypasses_torque_path(drive),
    };
    return voltage_reserve_step(&drive->motor->voltage_reserve, &task->voltage_reserve, &in);
}

/* A fast change of torque needs voltage. Near the voltage limit it would make the currents oscillate. */
static q15_t fastest_slew(const drive_t *drive)
{
    return (drive->task.reference.psi_plan < drive->motor->psi_weak) ? drive->motor->torque_slew_weak : Q15_MAX;
}

static q15_t slew_limit(const drive_t *drive)
{
    return (q15_t)fx_min_s32(drive->parameters.torque_slew, fastest_slew(drive));
}

static q15_t limit_torque(drive_t *drive, const snapshot_t *snapshot)
{
    static const torque_limits_t no_torque = {.power_drive = Q15_MAX, .power_regen = Q15_MAX};
    task_state_t *task = &drive->task;
    const torque_limit_in_t in = {
        .torque_arbitrated = drive->request.torque_arbitrated,
        .limits = switch_off_holds(drive) ? &no_torque : &drive->request.limits,
        .u = snapshot->sample.point.u,
        .i = snapshot->sample.point.i,
        .current = snapshot->i_magnitude,
        .torque_estimated = task->identification.torque_estimated,
        .omega = fx_q15_from_q31(snapshot->sample.point.omega),
        .v_dc = (q15_t)snapshot->sample.v_dc,
        .reach = task->reference.torque_max,
        .inverter_dC = snapshot->inverter_dC,
        .winding_dC = snapshot->winding_dC,
    };
    task->allowed = torque_limit_step(&drive->motor->torque_limit, &task->torque_limit, &in);
    task->derating = (uint16_t)(task->allowed.derating | (task->reference.i_d_limited ? DERATING_MAGNET : 0U));
    return task->allowed.torque_limited;
}

/* Arbitrated -> limited -> commanded (slew) -> corrected (torque loop): docs/glossary.md. A falling limit
 * acts at once, whatever slew is calibrated. */
static q15_t torque_path(drive_t *drive, const snapshot_t *snapshot)
{
    task_state_t *task = &drive->task;
    const q15_t limited = limit_torque(drive, snapshot);
    const q15_t before = task->torque_commanded;
    const q15_t allowed = torque_limit_clamp(&task->allowed, before, snapshot->sample.point.omega < 0);
    const q15_t inside = rate_limit_step(before, allowed, fastest_slew(drive));
    const int32_t moved = fx_abs_q31(inside - before);
    task->torque_commanded = rate_limit_step(inside, limited, (q15_t)fx_max_s32(slew_limit(drive) - moved, 0));
    const torque_loop_in_t loop = {
        .torque_commanded = task->torque_commanded,
        .torque_estimated = excess_torque_estimate(drive),
        .confidence = task->identification.confidence,
        .enabled = drive->request.torque_loop && !drive_bypasses_torque_path(drive),
        .limited = task->reference.limited || snapshot->sample.voltage_limited,
    };
    return torque_loop_step(&drive->parameters.torque_loop, &task->torque_loop, &loop);
}

/* Identified |psi_q| minus the tables'. */
static q15_t psi_q_delta(const drive_t *drive)
{
    return fx_mul_q15(fx_q15_from_q31(drive->task.identification.lq_error), fx_abs_q15(drive->task.psi_ref.q));
}

static dq_q15_t compute_references(drive_t *drive, const snapshot_t *snapshot)
{
    task_state_t *task = &drive->task;
    task->torque_corrected = torque_path(drive, snapshot);
    const voltage_reserve_t reserve = update_voltage_reserve(drive, snapshot);
    const current_reference_in_t in = {
        .torque_corrected = task->torque_corrected,
        .v_plan = reserve.v_plan,
        .omega = tracked_speed_planned(snapshot),
        .torque_limit = task->reference.torque_limit,
        .shift = reserve.shift,
        .psi_d_error = snapshot->psi_d_error,
        .i_d_max = i_d_limit_step(&drive->motor->i_d_limit, snapshot->psi_d_error, snapshot->winding_dC),
        .psi_q_delta = psi_q_delta(drive),
    };
    task->reference = current_reference_step(&drive->motor->current_reference, &in);
    task->reference.i_ref = drive_add_iron_current(drive, task->reference.i_ref);
    if (commission_runs(&task->commission)) {
        return task->commission.i_ref;
    }
    if (drive_is_moving(drive)) {
        return task->movement.i_ref;
    }
    return drive->request.current_mode ? drive->request.i_ref : task->reference.i_ref;
}

static void reset_torque_path(drive_t *drive)
{
    task_state_t *task = &drive->task;
    task->torque_loop = (torque_loop_state_t){0};
    task->torque_limit.loss = 0;
    task->derating = 0;
    task->reference = current_reference_start(drive->motor->torque_max);
    task->voltage_reserve = (voltage_reserve_state_t){0};
    task->allowed.torque_limited = 0;
    task->torque_commanded = 0;
    task->torque_corrected = 0;
}

static dq_q15_t next_references(drive_t *drive, const snapshot_t *snapshot)
{
    if (switch_off_runs(drive)) {
        reset_torque_path(drive);
        return switch_off_reference(drive);
    }
    return compute_references(drive, snapshot);
}

/* Writes the command for the fast ISR. commanded: the operating point that follows from it. */
static void command_fast_isr(drive_t *drive, const snapshot_t *snapshot, uint32_t faults, operating_point_t *commanded)
{
    task_state_t *task = &drive->task;
    const bool runs = task->run_state == RUN_STATE_RUN && faults == 0U && !drive_has_ended_movement(drive);
    command_t command;
    command.run = drive_bridge_mode(drive, runs);
    command.faults = faults;
    command.fault_resets = task->fault_resets;
    if (runs) {
        commanded->i = next_references(drive, snapshot);
        commanded->flux = flux_table_step(&drive->motor->flux_table, commanded->i);
        task->i_ref = commanded->i;
        task->psi_ref = (dq_q15_t){commanded->flux.psi_d, commanded->flux.psi_q};
        command.target = current_control_target(&drive->parameters.current_control, commanded,
                                                current_control_by_target(snapshot->psi_d_error), &task->rotating);
    } else {
        command.target = (current_target_t){0};
        reset_torque_path(drive);
        task->rotating = (rotating_flux_t){.psi = {commanded->flux.psi_d, commanded->flux.psi_q}};
    }
    command.safe = safe_decision_step(drive, snapshot);
    command.upper = safe_decision_is_upper(drive);
    command_box_write(&drive->commands, command);
}

/* Copies everything from the same period: if a period came in between, the copy is repeated. Copying is much shorter
 * than a period, so one repetition suffices. What the paper's identification writes later is used in the next step. */
static void take_snapshot(const drive_t *drive, snapshot_t *snapshot)
{
    uint32_t generation;
    snapshot->mrai_is_chosen = mrai_is_chosen(drive);
    do {
        generation = drive->samples.generation;
        exchange_barrier();
        snapshot->sample = *sample_box_at(&drive->samples, generation);
        snapshot->i_last_period = sample_box_at(&drive->samples, generation - 1U)->point.i;
        snapshot->window = *window_box_at(&drive->windows);
        if (snapshot->mrai_is_chosen) {
            mrai_snapshot(drive, snapshot);
        }
        snapshot->psi_d_error = drive->psi_d_error;
        snapshot->faults = drive->fast.faults;
        snapshot->shorted = drive_is_shorted(drive);
        exchange_barrier();
    } while (drive->samples.generation != generation);
    snapshot->generation = generation;
    snapshot->gates = hal_pwm_gates();
    snapshot->angle_absolute = hal_angle_is_absolute();
    snapshot->inverter_dC = hal_temperature_inverter_dC();
    snapshot->winding_dC = hal_temperature_winding_dC();
    snapshot->known_permille = hal_adc_known_permille();
    snapshot->lag = torque_monitor_lag(&drive->motor->torque_monitor, &drive->task.torque_monitor,
                                       fx_q15_from_q31(snapshot->sample.point.omega));
    step_mean_take(drive, snapshot);
}

void task_1khz(drive_t *drive)
{
    task_state_t *task = &drive->task;
    snapshot_t snapshot;
    data_check_restore_pointer(drive);
    take_snapshot(drive, &snapshot);
    angle_harmonics_step(&drive->motor->angle_harmonics, &task->angle_harmonics, snapshot.sample.theta_m,
                         task->angle_correction);
    uint32_t faults = slow_monitors_step(drive, &snapshot) | data_check_step(drive) | drive->request.faults;
    task->flow = flow_pass(task->flow, FLOW_MONITORED);
    task->run_state = switch_off_step(drive, &snapshot, next_run_state(drive, &snapshot), &faults);
    task->flow = flow_pass(task->flow, FLOW_DECIDED);
    drive_identify(drive, &snapshot);
    drive_commission(drive, &snapshot);
    drive_move(drive, &snapshot);
    drive_pulse(drive, &snapshot);
    operating_point_t commanded = snapshot.sample.point;
    command_fast_isr(drive, &snapshot, faults, &commanded);
    task->flow = flow_pass(task->flow, FLOW_COMMANDED);
    if (snapshot.mrai_is_chosen) {
        mrai_reschedule(drive, &snapshot, &commanded);
    }
}
