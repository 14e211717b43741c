/* SPDX-License-Identifier: Apache-2.0 */
/* The stages of the 1 kHz task as functions of their own, and the supervisor's of the bus. Each works on a copy of the
 * drive as the task is about to find it, with the inputs that the task gives it; it leaves nothing behind. Compiled as
 * the task is: small, but for what is in fast_sources.txt, which is called, not compiled in. */
#include "app/arbitrate.h"
#include "app/drive.h"
#include "app/slow_monitors.h"
#include "app/supervisor.h"
#include "fx/vec.h"
#include "hal/temperature.h"
#include "signal/rate_limit.h"

#define CALLED __attribute__((used, externally_visible, noinline))

const drive_t *drive_now(void);
void task_copy(void);
void task_nothing(void);
void task_angle_harmonics(void);
void task_slow_monitors(void);
void task_identify(void);
void task_trim(void);
void task_torque_limit(void);
void task_torque_loop(void);
void task_reference(void);
void task_target(void);
void task_safe_state(void);
void task_schedule(void);
void task_supervisor(void);
void task_arbitrate(void);

static drive_t copy;
static view_t view;
static mrai_in_t next;
static volatile int32_t result;
static supervisor_t supervisor = {.state = STATE_RUN, .enabled = true, .enable_seen = true};
static arbitrate_state_t arbitration;

/* The drive by its address, as the task has it. */
static drive_t *the_copy(void)
{
    drive_t *address = &copy;
    __asm__("" : "+r"(address));
    return address;
}

CALLED void task_copy(void)
{
    copy = *drive_now();
    view.sample = *sample_box_look(&copy.samples, copy.samples.generation);
    view.window = *window_box_look(&copy.windows);
    view.mrai = copy.slow.mrai;
    view.psi_delta = drive_psi_delta(&copy);
    view.torque = copy.slow.torque;
    view.faults = copy.fast.faults;
    view.inverter_dC = hal_temperature_inverter_dC();
    view.winding_dC = hal_temperature_winding_dC();
    next = view.sample.mrai;
}

CALLED void task_nothing(void)
{
    __asm__ volatile("");
}

CALLED void task_angle_harmonics(void)
{
    drive_t *d = the_copy();
    angle_harmonics_step(&d->motor.angle_harmonics, &d->task.angle_harmonics, view.sample.theta_m,
                         d->task.angle_correction);
}

CALLED void task_slow_monitors(void)
{
    result = (int32_t)slow_monitors_step(the_copy(), &view);
}

CALLED void task_identify(void)
{
    drive_t *d = the_copy();
    const identify_point_t point = identify_point(&d->motor.identify, &view.window, view.sample.mrai.omega);
    const identify_tables_t tables = {flux_table_step(&d->motor.flux_table, point.i_m),
                                      flux_table_inductances(&d->motor.flux_table, point.i_m)};
    const identify_in_t in = {
        .point = &point,
        .tables = &tables,
        .temperature_known = true,
        .winding_dC = view.winding_dC,
        .enabled = d->request.identification && view.sample.acting,
    };
    d->task.identified = identify_step(&d->motor.identify, &d->task.identify, &in);
}

CALLED void task_trim(void)
{
    drive_trim(the_copy(), (q15_t)view.sample.v_dc);
}

CALLED void task_torque_limit(void)
{
    drive_t *d = the_copy();
    const torque_limit_in_t in = {
        .wanted = d->request.torque,
        .limits = &d->request.limits,
        .u = view.sample.mrai.u,
        .i = view.sample.mrai.i,
        .torque = d->task.torque_estimate,
        .omega = fx_q15_from_q31(view.sample.mrai.omega),
        .v_dc = (q15_t)view.sample.v_dc,
        .reach = d->task.reference.torque_max,
        .inverter_dC = view.inverter_dC,
        .winding_dC = view.winding_dC,
    };
    d->task.allowed = torque_limit_step(&d->motor.torque_limit, &d->task.torque_limit, &in);
}

CALLED void task_torque_loop(void)
{
    drive_t *d = the_copy();
    d->task.torque_command = rate_limit_step(d->task.torque_command, d->task.allowed.torque, d->motor.torque_slew);
    const torque_loop_in_t in = {
        .command = d->task.torque_command,
        .estimate = d->task.torque_estimate,
        .confidence = d->task.identify.confidence,
        .enabled = d->request.torque_loop,
        .limited = d->task.reference.limited || view.sample.voltage_limited,
    };
    d->task.torque_request = torque_loop_step(&d->motor.torque_loop, &d->task.torque_loop, &in);
}

CALLED void task_reference(void)
{
    drive_t *d = the_copy();
    const voltage_reserve_in_t voltage = {
        .u = view.sample.mrai.u,
        .v_dc = (q15_t)view.sample.v_dc,
        .psi = d->task.psi_ref,
        .psi_plan = d->task.reference.psi_plan,
        .psi_delta = view.psi_delta,
        .acting = view.sample.acting,
    };
    const voltage_reserve_t trim = voltage_reserve_step(&d->motor.voltage_reserve, &d->task.voltage_reserve, &voltage);
    const dq_t i_ref = d->task.reference.i_ref;
    const current_reference_in_t in = {
        .torque = d->task.torque_request,
        .v_dc = (q15_t)view.sample.v_dc,
        .omega = fx_q15_from_q31(view.sample.mrai.omega),
        .i_magnitude = fx_magnitude((q15_t)i_ref.d, (q15_t)i_ref.q),
        .v_trim = trim.v_trim,
        .shift = trim.shift,
        .psi_delta = view.psi_delta,
        .i_d_max = i_d_limit_step(&d->motor.i_d_limit, view.psi_delta, view.winding_dC),
        .psi_q_delta = 0,
    };
    d->task.reference = current_reference_step(&d->motor.current_reference, &in);
}

CALLED void task_target(void)
{
    drive_t *d = the_copy();
    next.i = d->task.reference.i_ref;
    next.flux = flux_table_step(&d->motor.flux_table, next.i);
    command_t command = {.run = true};
    command.target = current_control_target(&d->motor.current_control, next.i, &next.flux);
    command_box_write(&d->commands, command);
}

CALLED void task_safe_state(void)
{
    drive_t *d = the_copy();
    const safe_state_in_t in = {
        .omega = fx_q15_from_q31(view.sample.mrai.omega),
        .psi_delta = view.psi_delta,
        .v_dc = (q15_t)view.sample.v_dc,
        .speed_valid = true,
    };
    result = safe_state_step(&d->motor.safe_state, &d->task.safe_state, &in) ? 1 : 0;
}

CALLED void task_schedule(void)
{
    drive_t *d = the_copy();
    const mrai_schedule_in_t in = {
        .sample = &view.sample.mrai,
        .next = &next,
        .identifier = &view.mrai,
        .enabled = view.sample.acting,
    };
    schedule_box_write(&d->schedules, mrai_schedule_step(&d->motor.mrai, &d->task.quality, &in));
}

/* While torque is made: of the drive's nine states the one it is in for years. */
CALLED void task_supervisor(void)
{
    const supervisor_in_t in = {
        .alive = true,
        .torque_mode = true,
        .enable = true,
        .dc_in_range = true,
        .dc_settled = true,
        .sensors_plausible = true,
        .derated = the_copy()->task.derating != 0U,
    };
    supervisor_step(&supervisor, &in);
}

/* Slew and jerk as app/ecu.c has them. */
CALLED void task_arbitrate(void)
{
    const drive_t *d = the_copy();
    const q31_t slew = d->motor.torque_max * 65536 / 40;
    const arbitrate_config_t config = {.slew = slew, .jerk = slew / 10, .ramp_out = slew};
    const arbitrate_in_t in = {
        .request = d->request.torque,
        .limit_drive = d->motor.torque_max,
        .limit_regen = d->motor.torque_max,
        .omega = view.sample.mrai.omega,
        .run = true,
    };
    arbitrate_hold(&config, &arbitration, d->task.allowed.torque);
    result = arbitrate_step(&config, &arbitration, &in);
}
