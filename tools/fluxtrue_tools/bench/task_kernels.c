/* SPDX-License-Identifier: Apache-2.0 */
/* The stages of the 1 kHz task as functions of their own, and the supervisor's of the bus. Each works on a copy of the
 * drive as the task is about to find it, with the inputs that the task gives it; it leaves nothing behind. Compiled as
 * the task is: small, but for what is in fast_sources.txt, which is called, not compiled in. */
#include <string.h>

#include "drive/drive.h"
#include "drive/iron_current.h"
#include "drive/mrai/mrai_seam.h"
#include "drive/slow_monitors.h"
#include "drive/step_mean.h"
#include "ecu/arbitration.h"
#include "ecu/supervisor.h"
#include "fx/vec.h"
#include "hal/adc.h"
#include "hal/temperature.h"
#include "scope/scope.h"
#include "second_level/second_level.h"
#include "signal/rate_limit.h"

#define PERIODS_OF_A_STEP 10U
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
void task_second_level(void);
void task_second_level_frame(void);
void task_scope_idle(void);
void task_scope_armed(void);
void task_scope_mixed(void);
void task_scope_seldom(void);
void task_scope_value(void);
void task_scope_edge(void);
void task_scope_triggered(void);

static drive_t copy;
static snapshot_t snapshot;
static volatile int32_t result;
static supervisor_t supervisor = {.state = STATE_RUN, .enabled = true, .enable_seen = true};
static arbitrate_state_t arbitration;
static second_level_t second_level;
static scope_t idle_scope, armed_scope, mixed_scope, seldom_scope, value_scope, edge_scope, triggered_scope;

/* The drive by its address, as the task has it. */
static drive_t *the_copy(void)
{
    drive_t *address = &copy;
    __asm__("" : "+r"(address));
    return address;
}

/* Waits for a level that never comes. */
static void arm(scope_t *scope, const capture_config_t *config, uint32_t newest)
{
    if (scope->capture.state == CAPTURE_IDLE) {
        capture_arm(&scope->capture, config, newest);
    }
}

/* One scope has been triggered and is armed again when it is complete, before the step that is counted. */
static void prepare_scopes(void)
{
    capture_config_t config = {
        .signals = CAPTURE_SIGNALS_MAX,
        .signal = SCOPE_USUAL_SIGNALS,
        .trigger = TRIGGER_ABOVE,
        .trigger_signal = CAPTURE_v_dc_V,
        .divisor = 1,
        .samples = CAPTURE_MEMORY / CAPTURE_SIGNALS_MAX,
        .level = INT16_MAX,
    };
    const uint32_t before = copy.samples.generation - PERIODS_OF_A_STEP;
    arm(&armed_scope, &config, before);
    if (triggered_scope.capture.state != CAPTURE_TRIGGERED) {
        capture_freeze(&triggered_scope.capture, &config, before + 1U, before);
    }
    config.divisor = PERIODS_OF_A_STEP;
    arm(&seldom_scope, &config, before);
    config.divisor = 1;
    config.trigger_signal = CAPTURE_i_d_ref_A;
    arm(&value_scope, &config, before);
    config.trigger = TRIGGER_RISING;
    config.trigger_signal = CAPTURE_v_dc_V;
    config.level = INT16_MIN; /* the signal is never below */
    arm(&edge_scope, &config, before);
    config.trigger = TRIGGER_ABOVE;
    config.level = INT16_MAX;
    const uint8_t mixed[CAPTURE_SIGNALS_MAX] = {
        CAPTURE_i_d_A,       CAPTURE_i_d_ref_A,           CAPTURE_i_q_ref_A,           CAPTURE_torque_commanded_Nm,
        CAPTURE_omega_rad_s, CAPTURE_torque_corrected_Nm, CAPTURE_torque_estimated_Nm, CAPTURE_psi_error_Vs};
    memcpy(config.signal, mixed, sizeof mixed);
    arm(&mixed_scope, &config, before);
}

CALLED void task_copy(void)
{
    copy = *drive_now();
    snapshot.sample = *sample_box_at(&copy.samples, copy.samples.generation);
    snapshot.window = *window_box_at(&copy.windows);
    snapshot.mrai_is_chosen = mrai_is_chosen(&copy);
    mrai_snapshot(&copy, &snapshot);
    snapshot.psi_d_error = copy.psi_d_error;
    snapshot.faults = copy.fast.faults;
    snapshot.inverter_dC = hal_temperature_inverter_dC();
    snapshot.winding_dC = hal_temperature_winding_dC();
    step_mean_take(&copy, &snapshot);
    prepare_scopes();
}

CALLED void task_nothing(void)
{
    __asm__ volatile("");
}

CALLED void task_angle_harmonics(void)
{
    drive_t *d = the_copy();
    angle_harmonics_step(&d->motor->angle_harmonics, &d->task.angle_harmonics, snapshot.sample.theta_m,
                         d->task.angle_correction);
}

CALLED void task_slow_monitors(void)
{
    result = (int32_t)slow_monitors_step(the_copy(), &snapshot);
}

CALLED void task_identify(void)
{
    drive_t *d = the_copy();
    const identify_point_t point = identify_point(&d->motor->identify, &snapshot.window, snapshot.sample.point.omega);
    const identify_tables_t tables = {flux_table_step(&d->motor->flux_table, point.i_m),
                                      flux_table_inductances(&d->motor->flux_table, point.i_m)};
    const identify_in_t in = {
        .point = &point,
        .tables = &tables,
        .winding_dC = snapshot.winding_dC,
        .enabled = d->request.identification && snapshot.sample.acting,
    };
    const identify_out_t out = identify_step(&d->motor->identify, &d->task.identify, &in);
    d->task.identification.torque_estimated = out.torque;
    d->task.psi_d_error = out.psi_d_error;
}

CALLED void task_trim(void)
{
    drive_trim(the_copy(), (q15_t)snapshot.sample.v_dc);
}

CALLED void task_torque_limit(void)
{
    drive_t *d = the_copy();
    const torque_limit_in_t in = {
        .torque_arbitrated = d->request.torque_arbitrated,
        .limits = &d->request.limits,
        .u = snapshot.sample.point.u,
        .i = snapshot.sample.point.i,
        .current = snapshot.i_magnitude,
        .torque_estimated = d->task.identification.torque_estimated,
        .omega = fx_q15_from_q31(snapshot.sample.point.omega),
        .v_dc = (q15_t)snapshot.sample.v_dc,
        .reach = d->task.reference.torque_max,
        .inverter_dC = snapshot.inverter_dC,
        .winding_dC = snapshot.winding_dC,
    };
    d->task.allowed = torque_limit_step(&d->motor->torque_limit, &d->task.torque_limit, &in);
}

CALLED void task_torque_loop(void)
{
    drive_t *d = the_copy();
    const q15_t limited = d->task.allowed.torque_limited;
    d->task.torque_commanded = rate_limit_step(d->task.torque_commanded, limited, d->parameters.torque_slew);
    const torque_loop_in_t in = {
        .torque_commanded = d->task.torque_commanded,
        .torque_estimated = d->task.identification.torque_estimated,
        .confidence = d->task.identify.kept.confidence,
        .enabled = d->request.torque_loop,
        .limited = d->task.reference.limited || snapshot.sample.voltage_limited,
    };
    d->task.torque_corrected = torque_loop_step(&d->parameters.torque_loop, &d->task.torque_loop, &in);
}

CALLED void task_reference(void)
{
    drive_t *d = the_copy();
    const voltage_reserve_in_t voltage = {
        .u = fx_magnitude(snapshot.u_mean.d, snapshot.u_mean.q),
        .v_dc = (q15_t)snapshot.sample.v_dc,
        .psi = d->task.psi_ref,
        .psi_plan = d->task.reference.psi_plan,
        .psi_d_error = snapshot.psi_d_error,
        .acting = snapshot.sample.acting,
    };
    const voltage_reserve_t reserve = voltage_reserve_step(&d->motor->voltage_reserve, &d->task.voltage_reserve,
                                                           &voltage);
    const current_reference_in_t in = {
        .torque_corrected = d->task.torque_corrected,
        .v_plan = reserve.v_plan,
        .omega = fx_q15_from_q31(snapshot.sample.point.omega),
        .torque_limit = d->task.reference.torque_limit,
        .shift = reserve.shift,
        .psi_d_error = snapshot.psi_d_error,
        .i_d_max = i_d_limit_step(&d->motor->i_d_limit, snapshot.psi_d_error, snapshot.winding_dC),
        .psi_q_delta = 0,
    };
    d->task.reference = current_reference_step(&d->motor->current_reference, &in);
    d->task.reference.i_ref = drive_add_iron_current(d, d->task.reference.i_ref);
}

CALLED void task_target(void)
{
    drive_t *d = the_copy();
    operating_point_t next = snapshot.sample.point;
    next.i = d->task.reference.i_ref;
    next.flux = flux_table_step(&d->motor->flux_table, next.i);
    command_t command = {.run = true};
    command.target = current_control_target(&d->parameters.current_control, &next,
                                            current_control_by_target(snapshot.psi_d_error), &d->task.rotating);
    command_box_write(&d->commands, command);
}

CALLED void task_safe_state(void)
{
    drive_t *d = the_copy();
    const safe_state_in_t in = {
        .omega = fx_q15_from_q31(snapshot.sample.point.omega),
        .psi_d_error = snapshot.psi_d_error,
        .v_dc = (q15_t)snapshot.sample.v_dc,
        .speed_valid = true,
    };
    result = safe_state_step(&d->motor->safe_state, &d->task.safe_state, &in) ? 1 : 0;
}

CALLED void task_schedule(void)
{
    mrai_reschedule(the_copy(), &snapshot, &snapshot.sample.point);
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
        .dc_near_battery = true,
        .sensors_plausible = true,
        .derated = the_copy()->task.derating != 0U,
        .elapsed_us = 1000,
    };
    supervisor_step(&supervisor, &in);
}

/* Slew and jerk as ecu/ecu.c has them. */
CALLED void task_arbitrate(void)
{
    const drive_t *d = the_copy();
    const q31_t slew = d->motor->torque_max * 65536 / 40;
    const arbitrate_config_t config = {.slew = slew, .jerk = slew / 10, .ramp_out = slew};
    const arbitrate_in_t in = {
        .torque_requested = d->request.torque_arbitrated,
        .limit_drive = d->motor->torque_max,
        .limit_regen = d->motor->torque_max,
        .omega = snapshot.sample.point.omega,
        .run = true,
    };
    arbitrate_hold(&config, &arbitration, d->task.allowed.torque_limited);
    result = arbitrate_step(&config, &arbitration, &in);
}

/* With a request of the rated torque, so that the drive's is permitted. */
CALLED void task_second_level(void)
{
    const drive_t *d = the_copy();
    second_level_in_t in = {
        .sample = {.theta_m = snapshot.sample.theta_m,
                   .psi_d_error = snapshot.psi_d_error,
                   .lq_error = fx_q15_from_q31(d->task.identification.lq_error)},
        .acting = snapshot.sample.acting,
        .slew = d->parameters.torque_slew,
        .elapsed_us = 1000,
    };
    hal_adc_latest(&in.sample.counts);
    result = second_level_step(d->motor->second_level, &second_level, &in);
}

/* A torque command of 100 N.m whose checksum is right. */
CALLED void task_second_level_frame(void)
{
    static const can_frame_t frame = {
        .id = 0x110, .length = 8, .data = {0x57, 0x50, 0xE8, 0x03, 0x10, 0x27, 0x10, 0x27}};
    second_level.frames.command.synced = true;
    second_level.frames.command.counter = 14;
    second_level_frame(&second_level.frames, &frame);
}

CALLED void task_scope_idle(void)
{
    scope_step(&idle_scope, the_copy(), false, false);
}

CALLED void task_scope_armed(void)
{
    scope_step(&armed_scope, the_copy(), false, false);
}

CALLED void task_scope_mixed(void)
{
    scope_step(&mixed_scope, the_copy(), false, false);
}

CALLED void task_scope_seldom(void)
{
    scope_step(&seldom_scope, the_copy(), false, false);
}

CALLED void task_scope_value(void)
{
    scope_step(&value_scope, the_copy(), false, false);
}

CALLED void task_scope_edge(void)
{
    scope_step(&edge_scope, the_copy(), false, false);
}

CALLED void task_scope_triggered(void)
{
    scope_step(&triggered_scope, the_copy(), false, false);
}
