/* SPDX-License-Identifier: Apache-2.0 */
#include "ecu/ecu.h"

#include "drive/data_check.h"
#include "ecu/ecu_private.h"
#include "ecu/telemetry.h"
#include "fx/codegen.h"
#include "hal/adc.h"
#include "hal/board.h"
#include "hal/can.h"
#include "hal/pwm.h"
#include "hal/shut_off.h"
#include "hal/system.h"
#include "hal/watchdog.h"
#include "signal/counter.h"
#include "types/si.h"

#define FRAMES_PER_TASK 32 /* a bus of 1 Mbit/s delivers fewer in a millisecond */
#define SLEW_MS 40         /* from zero to full torque */
#define JERK_MS 10         /* from zero to full slew */
#define RAMP_OUT_MS 15     /* from full torque to zero, after the time-out of 30 ms */
#define ONE_Q30 1073741824.0F
#define DEAD_BAND 2.5F /* counts of the requested torque on the bus */

/* A change per millisecond as a change per step. */
static q31_t per_step(const step_clock_t *clock, q31_t per_ms)
{
    const float share = ((float)clock->step_us + (float)clock->step_ns * 1e-3F) * 1e-3F;
    return (q31_t)(((int64_t)(int32_t)(share * ONE_Q30) * per_ms) >> 30);
}

void ecu_init(ecu_t *ecu, const motor_t *source)
{
    const q31_t full = source->torque_max * 65536;
    *ecu = (ecu_t){0};
    step_clock_start(&ecu->clock, (uint32_t)(source->bases.step_s * 1e9F + 0.5F));
    drive_init(&ecu->drive, source);
    xcp_access_init(&ecu->xcp, &ecu->drive, &ecu->freeze, &ecu->scope, (uint32_t)hal_system_reset_cause());
    const q31_t slew = per_step(&ecu->clock, full / SLEW_MS);
    ecu->arbitration_config = (arbitrate_config_t){
        .slew = slew,
        .jerk = per_step(&ecu->clock, slew / JERK_MS),
        .ramp_out = per_step(&ecu->clock, full / RAMP_OUT_MS) + 1,
        .dead_band = q15_from_si(DEAD_BAND * source->bus_scales.torque_Nm, source->bases.torque_Nm),
        .omega_standstill = DRIVE_STANDSTILL,
    };
    ecu_seal_rates(ecu);
    ecu_seal_flags(ecu);
}

void ecu_continue(ecu_t *ecu)
{
    ecu->supervisor.state = STATE_SAFE_STATE;
    ecu_seal_flags(ecu);
}

static void receive(ecu_t *ecu)
{
    can_frame_t frame;
    bool taken = false;
    for (int n = 0; n < FRAMES_PER_TASK && hal_can_receive(&frame); n++) {
        if (frame.id == XCP_ID_COMMAND && !frame.extended) {
            xcp_access_receive(&ecu->xcp, &ecu->drive, &ecu->scope, &frame);
        } else {
            second_level_frame(&ecu->second_level.frames, &frame);
            taken |= can_rx_frame(&ecu->rx, &ecu->drive.motor->bus_scales, &frame) == RX_ACCEPTED;
        }
    }
    can_rx_tick(&ecu->rx, ecu->clock.elapsed_us);
    ecu_convert(ecu, taken);
}

/* Whether the board's hardware must hold the bridge: the firmware does not advance, or has no gate supply for the short
 * circuit that the speed needs. In the first step the speed is not known yet. */
static bool needs_hardware(const ecu_t *ecu, const state_outputs_t *on)
{
    const bool may_rectify = !ecu->liveness.started || ecu->drive.task.safe_state.rectifies;
    return (ecu->supervisor.faults & ECU_FAULT_STALL) != 0U || (may_rectify && !on->gate_driver);
}

static void set_outputs(const ecu_t *ecu)
{
    const state_outputs_t *on = &supervisor_outputs[ecu->supervisor.state];
    hal_board_set(BOARD_PRECHARGE, on->precharge);
    hal_board_set(BOARD_MAIN_CONTACTOR, on->contactor);
    hal_board_set(BOARD_DISCHARGE, on->discharge);
    hal_board_set(BOARD_GATE_DRIVER, on->gate_driver || ecu->shut_off.supply_on);
    hal_board_set(BOARD_SAFE_STATE, needs_hardware(ecu, on));
}

/* The watchdog's question is answered at the end of the step, by the signature of the parts that have run. */
static void begin_step(ecu_t *ecu)
{
    const state_outputs_t *on = &supervisor_outputs[ecu->supervisor.state];
    const shut_off_in_t in = {
        .fitted = hal_shut_off_question(&ecu->question),
        .supply = hal_shut_off_supply(),
        .switching = !ecu->shut_off.tested && hal_pwm_gates(), /* only the test compares it */
        .wanted = on->gate_driver,
        .idle = !on->contactor && !on->precharge,
        .elapsed_us = ecu->clock.elapsed_us,
    };
    ecu->drive.task.flow = ecu->question;
    shut_off_step(&ecu->shut_off, &in);
}

static void answer(ecu_t *ecu)
{
    const uint32_t right = ecu->drive.task.flow ^ ecu->second_level.flow;
    hal_shut_off_answer(ecu->shut_off.wrong ? ~right : right);
}

/* A falling limit and a ramp to zero act without the calibrated slew, once the arbitrated torque has reached them. */
static void lower_limits(torque_limits_t *limits, const arbitrate_in_t *in, q15_t arbitrated)
{
    const q15_t magnitude = fx_abs_q15(arbitrated);
    limits->torque_drive = (q15_t)fx_max_s32(in->ramp_out ? (q15_t)0 : in->limit_drive, magnitude);
    limits->torque_regen = (q15_t)fx_max_s32(in->ramp_out ? (q15_t)0 : in->limit_regen, magnitude);
}

static void command_drive(ecu_t *ecu)
{
    request_t *request = &ecu->drive.request;
    const arbitrate_in_t in = ecu_arbitration(ecu);
    arbitrate_hold(&ecu->arbitration_config, &ecu->arbitration_state, ecu->drive.task.allowed.torque_limited);
    request->torque_arbitrated = arbitrate_step(&ecu->arbitration_config, &ecu->arbitration_state, &in);
    torque_limits_t limits = ecu_limits(ecu);
    lower_limits(&limits, &in, request->torque_arbitrated);
    request->limits = limits;
    request->enable = in.run;
    request->may_hold = ecu->supervisor.state == STATE_READY;
    request->fault_resets = ecu->supervisor.resets;
    ecu_request_commissioning(ecu);
}

/* The samples that a step of the second level uses. */
typedef struct {
    current_counts_t counts;
    uint32_t theta_m;
    bool acting;
} raw_sample_t;

/* The currents' counts, which the first level has not scaled, and the angle of the same period. */
static raw_sample_t read_raw_sample(const drive_t *drive)
{
    raw_sample_t raw;
    uint32_t generation;
    do {
        generation = drive->samples.generation;
        exchange_barrier();
        const sample_t *sample = sample_box_at(&drive->samples, generation);
        hal_adc_latest(&raw.counts);
        raw.theta_m = sample->theta_m;
        raw.acting = sample->acting;
        exchange_barrier();
    } while (drive->samples.generation != generation);
    return raw;
}

/* The second level uses the samples and its own constants; the drive latches its fault in the next step. */
static void check_by_second_level(ecu_t *ecu, const raw_sample_t *raw)
{
    drive_t *drive = &ecu->drive;
    const second_level_in_t in = {
        .sample = {.counts = raw->counts,
                   .theta_m = raw->theta_m,
                   .psi_d_error = drive->psi_d_error,
                   .lq_error = fx_q15_from_q31(drive->task.identification.lq_error)},
        .acting = raw->acting && !movement_is_agreed(&drive->task.movement), /* its angle is not that of the data */
        .slew = drive->parameters.torque_slew,
        .elapsed_us = ecu->clock.elapsed_us,
        .question = ecu->question,
    };
    const second_level_constants_t *constants = drive->motor->second_level;
    drive->data_check.damaged |= !second_level_own_data_step(constants, &ecu->second_level.own_data);
    drive->request.faults = second_level_step(constants, &ecu->second_level, &in) ? FAULT_TORQUE : 0U;
}

static void service_watchdog(ecu_t *ecu)
{
    if (!ecu->liveness.started) {
        ecu->liveness.started = true;
        hal_watchdog_start();
    } else if (ecu->liveness.stalled_in_a_row == 0U) {
        hal_watchdog_service();
    } else {
        count_up(&ecu->liveness.held);
    }
}

/* In four of ten steps no frame is due, and nothing is collected. Not inlined: telemetry would deepen the stack. */
static FX_NOT_INLINED void send_frames(ecu_t *ecu)
{
    telemetry_t telemetry;
    can_frame_t frame;
    can_tx_begin(&ecu->tx, ecu->clock.passed_ms);
    if (!can_tx_due(&ecu->tx)) {
        return;
    }
    telemetry_read(&ecu->drive, &ecu->tx, &telemetry);
    ecu_telemetry(ecu, &telemetry);
    ecu_diagnostics(ecu, &telemetry);
    for (tx_result_t r = can_tx_next(&ecu->tx, &telemetry, &frame); r != TX_NONE;
         r = can_tx_next(&ecu->tx, &telemetry, &frame)) {
        if (r == TX_NOT_A_NUMBER || !hal_can_send(&frame)) {
            count_up(&ecu->not_sent);
        }
    }
}

/* After the cyclic frames, and only while mailboxes are free; the rest waits for the next step. */
static void send_xcp(ecu_t *ecu)
{
    can_frame_t frame;
    while (xcp_access_next(&ecu->xcp, &frame) && hal_can_send(&frame)) {
        xcp_access_sent(&ecu->xcp);
    }
}

void ecu_task_1khz(ecu_t *ecu)
{
    data_check_restore_pointer(&ecu->drive);
    const raw_sample_t raw = read_raw_sample(&ecu->drive); /* first: before the next period's conversions end */
    ecu_check_integrity(ecu);
    step_clock_step(&ecu->clock);
    begin_step(ecu);
    ecu_pass(ecu, FLOW_INTEGRITY);
    receive(ecu);
    ecu_pass(ecu, FLOW_RECEIVED);
    ecu_watch(ecu);
    const supervisor_in_t in = ecu_observe(ecu, hal_board_gate_fault());
    supervisor_step(&ecu->supervisor, &in);
    set_outputs(ecu);
    ecu_pass(ecu, FLOW_STATES);
    command_drive(ecu);
    ecu_pass(ecu, FLOW_ARBITRATED);
    ecu_check_dc_sensor(ecu);
    task_1khz(&ecu->drive);
    check_by_second_level(ecu, &raw);
    ecu_pass(ecu, FLOW_CHECKED);
    service_watchdog(ecu);
    answer(ecu);
    xcp_access_step(&ecu->xcp, &ecu->drive, ecu->clock.passed_ms);
    const bool changed = freeze_frame_step(&ecu->freeze, &ecu->xcp.measurements, ecu->supervisor.faults,
                                           (uint8_t)ecu->supervisor.state, ecu->clock.passed_ms);
    scope_step(&ecu->scope, &ecu->drive, changed, ecu->freeze.frozen != 0U);
    send_frames(ecu);
    send_xcp(ecu);
    ecu_seal_flags(ecu);
}
