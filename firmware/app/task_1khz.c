/* SPDX-License-Identifier: Apache-2.0 */
#include "app/drive.h"
#include "app/slow_monitors.h"
#include "fx/vec.h"
#include "hal/temperature.h"
#include "signal/rate_limit.h"

/* Gates that never closed stay open: the bridge may not even be powered. */
static safe_t safe_state(drive_t *drive, const view_t *view)
{
    task_state_t *task = &drive->task;
    const uint32_t faults = view->faults;
    const safe_state_in_t in = {
        .omega = fx_q15_from_q31(view->sample.mrai.omega),
        .psi_delta = view->psi_delta,
        .v_dc = (q15_t)view->sample.v_dc,
        .speed_valid = (faults & (FAULT_ANGLE | FAULT_INPUT)) == 0U,
        .over_voltage = (faults & FAULT_OVER_VOLTAGE) != 0U,
    };
    const bool closed = safe_state_step(&drive->motor.safe_state, &task->safe_state, &in);
    task->armed = task->run_state == RUN_STATE_RUN || (task->armed && (closed || faults != 0U));
    if (!task->armed) {
        return SAFE_FREEWHEEL;
    }
    if (closed) {
        return SAFE_SHORT_CIRCUIT;
    }
    return in.over_voltage ? SAFE_FREEWHEEL : SAFE_SHORT_ON_OVER_VOLTAGE;
}

static run_state_t supervise(drive_t *drive, uint32_t faults)
{
    const request_t *request = &drive->request;
    task_state_t *task = &drive->task;
    const bool enable = request->enable; /* read once: a reset never goes down with the command to run */
    if (request->fault_resets != task->fault_resets_asked) {
        task->fault_resets_asked = request->fault_resets; /* refused while enabled, and not kept for later */
        task->fault_resets += enable ? 0U : 1U;
    }
    if (request->identification_resets != task->identification_resets) {
        task->identification_resets = request->identification_resets;
        task->quality = (mrai_quality_t){0};
        identify_reset(&drive->motor.identify, &task->identify);
        drive_retrim(drive, 0);
    }
    if (faults != 0U) {
        return RUN_STATE_FAULT;
    }
    return enable ? RUN_STATE_RUN : RUN_STATE_OFF;
}

/* What the voltage of this millisecond says about the plan of the last one. */
static voltage_reserve_t reserve(drive_t *drive, const view_t *view)
{
    task_state_t *task = &drive->task;
    const voltage_reserve_in_t in = {
        .u = view->sample.mrai.u,
        .v_dc = (q15_t)view->sample.v_dc,
        .psi = task->psi_ref,
        .psi_plan = task->reference.psi_plan,
        .psi_delta = view->psi_delta,
        .acting = view->sample.acting && !drive_is_direct(drive),
    };
    return voltage_reserve_step(&drive->motor.voltage_reserve, &task->voltage_reserve, &in);
}

/* Wide open, a step is for a machine that has voltage to follow it: near the limit it would only throw the currents
 * about. */
static q15_t slew_of(const drive_t *drive)
{
    const motor_t *m = &drive->motor;
    const bool weak = drive->task.reference.psi_plan < m->psi_weak;
    return weak ? (q15_t)fx_min_s32(m->torque_slew, m->torque_slew_weak) : m->torque_slew;
}

static q15_t allowed(drive_t *drive, const view_t *view)
{
    task_state_t *task = &drive->task;
    const torque_limit_in_t in = {
        .wanted = drive->request.torque,
        .limits = &drive->request.limits,
        .u = view->sample.mrai.u,
        .i = view->sample.mrai.i,
        .torque = task->torque_estimate,
        .omega = fx_q15_from_q31(view->sample.mrai.omega),
        .v_dc = (q15_t)view->sample.v_dc,
        .reach = task->reference.torque_max,
        .inverter_dC = view->inverter_dC,
        .winding_dC = view->winding_dC,
    };
    task->allowed = torque_limit_step(&drive->motor.torque_limit, &task->torque_limit, &in);
    const uint32_t magnet = task->reference.i_d_limited ? DERATING_MAGNET : 0U;
    task->derating = (uint16_t)(task->allowed.derating | magnet);
    return task->allowed.torque;
}

/* Request -> limits -> slew -> torque loop -> what the current reference is asked for. A limit that closes is not
 * slewed: what is no longer allowed or possible is not asked for. */
static q15_t torque_path(drive_t *drive, const view_t *view)
{
    task_state_t *task = &drive->task;
    const motor_t *m = &drive->motor;
    const q15_t wanted = allowed(drive, view);

    task->torque_command = rate_limit_step(task->torque_command, wanted, slew_of(drive));
    const torque_loop_in_t loop = {
        .command = task->torque_command,
        .estimate = task->torque_estimate,
        .confidence = (drive->request.identification_mode == IDENTIFICATION_ROBUST) ? task->identify.confidence
                                                                                     : Q15_MAX,
        .enabled = drive->request.torque_loop && !drive_is_direct(drive),
        .limited = task->reference.limited || view->sample.voltage_limited,
    };
    return torque_loop_step(&m->torque_loop, &task->torque_loop, &loop);
}

/* What the identified |psi_q| is more than the tables'. */
static q15_t psi_q_delta(const drive_t *drive)
{
    return fx_mul_q15(fx_q15_from_q31(drive_lq_error(drive)), fx_abs_q15((q15_t)drive->task.psi_ref.q));
}

static dq_t references(drive_t *drive, const view_t *view)
{
    task_state_t *task = &drive->task;
    task->torque_request = torque_path(drive, view);
    const voltage_reserve_t trim = reserve(drive, view);
    const current_reference_in_t in = {
        .torque = task->torque_request,
        .v_dc = (q15_t)view->sample.v_dc,
        .omega = fx_q15_from_q31(view->sample.mrai.omega),
        .i_magnitude = fx_magnitude((q15_t)task->reference.i_ref.d, (q15_t)task->reference.i_ref.q),
        .v_trim = trim.v_trim,
        .shift = trim.shift,
        .psi_delta = view->psi_delta,
        .i_d_max = i_d_limit_step(&drive->motor.i_d_limit, view->psi_delta, view->winding_dC),
        .psi_q_delta = psi_q_delta(drive),
    };
    task->reference = current_reference_step(&drive->motor.current_reference, &in);
    if (commission_runs(&task->commission)) {
        return task->commission.i_ref;
    }
    return drive->request.current_mode ? drive->request.i_ref : task->reference.i_ref;
}

static void rest(drive_t *drive)
{
    task_state_t *task = &drive->task;
    task->torque_loop = (torque_loop_state_t){0};
    task->torque_limit.loss = 0;
    task->derating = 0;
    task->reference = (current_reference_t){.torque_max = drive->motor.torque_max, .psi_plan = Q15_MAX};
    task->voltage_reserve = (voltage_reserve_state_t){0};
    task->torque_command = 0;
    task->torque_request = 0;
}

/* What the fast ISR is to do until the next step; next becomes the operating point just commanded. */
static void order(drive_t *drive, const view_t *view, uint32_t found, mrai_in_t *next)
{
    task_state_t *task = &drive->task;
    command_t command = {
        .run = task->run_state == RUN_STATE_RUN && found == 0U,
        .faults = found,
        .fault_resets = task->fault_resets,
    };
    if (command.run) {
        next->i = references(drive, view);
        next->flux = flux_table_step(&drive->motor.flux_table, next->i);
        task->i_ref = next->i;
        task->psi_ref = (dq_t){next->flux.psi_d, next->flux.psi_q};
        command.target = current_control_target(&drive->motor.current_control, next->i, &next->flux);
    } else {
        rest(drive);
    }
    command.safe = safe_state(drive, view);
    command_box_write(&drive->commands, command);
}

/* All from between the same two periods: taken again if one has come in between, which the copying is too short for to
 * happen twice. What the identification writes later in the step, its answer to this one included, waits for the
 * next. */
static void look(const drive_t *drive, view_t *view)
{
    uint32_t seen;
    do {
        seen = drive->samples.generation;
        exchange_barrier();
        view->sample = *sample_box_look(&drive->samples, seen);
        view->window = *window_box_look(&drive->windows);
        view->mrai = drive->slow.mrai;
        view->psi_delta = drive_psi_delta(drive);
        view->torque = drive->slow.torque;
        view->faults = drive->fast.faults;
        exchange_barrier();
    } while (drive->samples.generation != seen);
    view->inverter_dC = hal_temperature_inverter_dC();
    view->winding_dC = hal_temperature_winding_dC();
}

void task_1khz(drive_t *drive)
{
    task_state_t *task = &drive->task;
    view_t view;
    look(drive, &view);
    angle_harmonics_step(&drive->motor.angle_harmonics, &task->angle_harmonics, view.sample.theta_m,
                         task->angle_correction);
    const uint32_t found = slow_monitors_step(drive, &view);
    task->run_state = supervise(drive, view.faults);
    drive_identify(drive, &view);
    drive_commission(drive, &view);

    mrai_in_t next = view.sample.mrai;
    order(drive, &view, found, &next);
    if (drive->request.identification_mode != IDENTIFICATION_PAPER) {
        return;
    }
    const mrai_schedule_in_t schedule = {
        .sample = &view.sample.mrai,
        .next = &next,
        .identifier = &view.mrai,
        .enabled = drive->request.identification && view.sample.acting,
    };
    schedule_box_write(&drive->schedules, mrai_schedule_step(&drive->motor.mrai, &task->quality, &schedule));
}
