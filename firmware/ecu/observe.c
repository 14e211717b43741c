/* SPDX-License-Identifier: Apache-2.0 */
#include "ecu/ecu_private.h"
#include "hal/angle.h"
#include "signal/counter.h"
#include "signal/debounce.h"
#include "types/si.h"

#define CONSECUTIVE_MAX 3U
#define PERIODS_MAX_STEPS 4U    /* a task that is later than this has latched another fault */
#define TOUCH_SAFE_V 60.0F      /* ISO 6469-3, dc */
#define SETTLED_BAND Q15(0.01)  /* of V_b */
#define SETTLED_US 50000U
#define SLOW_SHARE Q15(0.8)      /* of the lowest dc voltage at which the drive runs */
#define IDLE_CURRENT Q15(0.02)  /* of I_b: more, with switching disabled, is an offset or a broken sensor */

/* The first reason that applies is transmitted. Rated torque and the reach of voltage and current are not derating. */
static const struct {
    uint16_t derating;
    uint8_t reason;
} reasons[] = {
    {DERATING_INVERTER, DERATING_REASON_INVERTER_TEMPERATURE},
    {DERATING_WINDING, DERATING_REASON_WINDING_TEMPERATURE},
    {DERATING_SENSOR, DERATING_REASON_TEMPERATURE_SENSOR},
    {DERATING_DC_LOW | DERATING_DC_HIGH, DERATING_REASON_DC_VOLTAGE},
    {DERATING_POWER, DERATING_REASON_BATTERY_POWER},
    {DERATING_MAGNET, DERATING_REASON_MAGNET},
    {DERATING_SPEED, DERATING_REASON_SPEED},
};

void ecu_watch(ecu_t *ecu)
{
    liveness_t *liveness = &ecu->liveness;
    const progress_t progress = drive_progress(&ecu->drive);
    const uint32_t in_step = ecu->drive.motor->bases.periods_per_step;
    const bool late = liveness->started && progress.periods >= in_step + in_step / 2U;
    (void)debounce_holds(&liveness->late_in_a_row, late, CONSECUTIVE_MAX);
    (void)debounce_holds(&liveness->stalled_in_a_row, progress.stalled, CONSECUTIVE_MAX);
    if (progress.periods != 0U && progress.periods < PERIODS_MAX_STEPS * in_step) {
        ecu_pass(ecu, FLOW_INTERRUPTS);
    }
    if (late) {
        count_up(&liveness->task_overruns);
    }
}

/* Counted from the start of the precharge: before it a turning machine may keep the dc link, through the diodes, at a
 * voltage that is not the battery's. */
static bool is_dc_settled(ecu_t *ecu, int32_t v_dc)
{
    settling_t *settling = &ecu->settling;
    const int32_t away = v_dc - settling->reference;
    if (ecu->supervisor.state != STATE_PRECHARGE || away > SETTLED_BAND || away < -SETTLED_BAND) {
        *settling = (settling_t){.reference = v_dc};
    } else if (settling->us < SETTLED_US) {
        settling->us += ecu->clock.elapsed_us;
    }
    return settling->us >= SETTLED_US;
}

/* Above this speed the line back-EMF may drive currents through the diodes into the dc link. */
static bool may_rectify(const drive_t *drive, const sample_t *sample)
{
    return drive->task.safe_state.rectifies && sample->v_dc >= drive->motor->monitor.v_min;
}

/* With switching disabled there is no current below the speed at which the diodes conduct; while the bridge switches,
 * the monitors check it. */
static bool are_sensors_plausible(const drive_t *drive, const sample_t *sample)
{
    const dq_q15_t i = sample->point.i;
    const bool idle = i.d <= IDLE_CURRENT && i.d >= -IDLE_CURRENT && i.q <= IDLE_CURRENT && i.q >= -IDLE_CURRENT;
    const bool switches = drive->task.run_state == RUN_STATE_RUN || drive_is_shorted(drive);
    return drive->samples.generation != 0U && (idle || switches || may_rectify(drive, sample));
}

/* Whether contactor and gate supply may be switched off: at the known speed (safety/safe_state.h) the line back-EMF is
 * below the voltage that is safe to touch, and below 0.8 of the lowest dc voltage at which the drive runs. At higher
 * speed and without contactor and gate supply the diodes would charge the dc link, at high speed beyond what the
 * inverter withstands. A gate fault may need both for longer (safety/gate_fault.h). */
static bool is_slow(const drive_t *drive)
{
    const q15_t least = fx_mul_q15(SLOW_SHARE, drive->motor->monitor.v_min);
    const q15_t line_emf = drive->task.safe_state.line_emf;
    return !drive->task.gate_fault.holds_supply && line_emf < least &&
           si_from_q15(line_emf, drive->motor->bases.voltage_V) < TOUCH_SAFE_V;
}

static q15_t per_unit(const ecu_t *ecu, float torque_Nm)
{
    return q15_from_si(torque_Nm, ecu->drive.motor->bases.torque_Nm);
}

static bool are_limits_lost(const ecu_t *ecu)
{
    return ecu->rx.limits_channel.seen && !ecu->rx.limits_channel.alive;
}

static uint32_t derating_reason(const ecu_t *ecu)
{
    if (are_limits_lost(ecu)) {
        return DERATING_REASON_BATTERY_LIMITS_LOST;
    }
    const uint32_t derating = ecu->drive.task.derating & ~(uint32_t)(DERATING_REQUEST | DERATING_REACH);
    for (unsigned n = 0; derating != 0U && n < sizeof reasons / sizeof reasons[0]; n++) {
        if ((derating & reasons[n].derating) != 0U) {
            return reasons[n].reason;
        }
    }
    return DERATING_REASON_NONE;
}

static q15_t power_per_unit(const ecu_t *ecu, float power_kW)
{
    const bases_t *b = &ecu->drive.motor->bases;
    return q15_from_si(1000.0F * power_kW, 1.5F * b->voltage_V * b->current_A);
}

void ecu_convert(ecu_t *ecu, bool taken)
{
    const can_rx_t *rx = &ecu->rx;
    if (!taken && rx->command_channel.alive) { /* else a time-out may have cleared the command */
        return;
    }
    ecu->commanded = (commanded_t){
        .torque_requested = per_unit(ecu, rx->command.torque_requested_Nm),
        .limit_drive = per_unit(ecu, rx->command.limit_drive_Nm),
        .limit_regen = per_unit(ecu, rx->command.limit_regen_Nm),
        .power_drive = power_per_unit(ecu, rx->limits.drive_kW),
        .power_regen = power_per_unit(ecu, rx->limits.regen_kW),
    };
}

/* Power limits of the battery. The torque limits are not among them: arbitration applies those, with its slew. When the
 * battery limits are lost, arbitration ramps the torque to zero; the last limits are kept meanwhile, because without
 * them the torque would rise at the start of the ramp. */
torque_limits_t ecu_limits(const ecu_t *ecu)
{
    torque_limits_t limits = are_limits_lost(ecu) ? ecu->drive.request.limits : TORQUE_LIMITS_NONE;
    if (ecu->rx.limits_channel.alive) {
        limits.power_drive = ecu->commanded.power_drive;
        limits.power_regen = ecu->commanded.power_regen;
    }
    return limits;
}

/* The battery's voltage of the bus, and the dc voltage that the inverter measures. */
static battery_voltage_in_t battery_voltage(const ecu_t *ecu, float v_dc_V)
{
    return (battery_voltage_in_t){.battery_V = ecu->rx.battery_V,
                                  .v_dc_V = v_dc_V,
                                  .alive = ecu->rx.limits_channel.alive,
                                  .contactor = supervisor_outputs[ecu->supervisor.state].contactor,
                                  .elapsed_us = ecu->clock.elapsed_us};
}

supervisor_in_t ecu_observe(ecu_t *ecu, bool gate_fault)
{
    const drive_t *drive = &ecu->drive;
    const bus_command_t *command = &ecu->rx.command;
    const sample_t *sample = sample_box_last(&drive->samples);
    const float v_dc_V = si_from_q15(sample->v_dc, drive->motor->bases.voltage_V);
    const battery_voltage_in_t voltages = battery_voltage(ecu, v_dc_V);
    return (supervisor_in_t){
        .drive_faults = drive->fast.faults,
        .alive = ecu->rx.command_channel.alive,
        .failed = ecu->rx.command_channel.failed,
        .torque_mode = command->mode == COMMAND_MODE_TORQUE,
        .current_mode = command->mode == COMMAND_MODE_CURRENT_LOCKED,
        .enable = command->enable,
        .reset = command->fault_reset,
        .torque_requested_is_zero = fx_abs_q15(ecu->commanded.torque_requested) <= ecu->arbitration_config.dead_band,
        .torque_arbitrated_is_zero = ecu->arbitration_state.torque_arbitrated == 0,
        .dc_in_range = sample->v_dc >= drive->motor->monitor.v_min && sample->v_dc <= drive->motor->monitor.v_max,
        .dc_settled = is_dc_settled(ecu, sample->v_dc),
        .dc_safe = v_dc_V < TOUCH_SAFE_V,
        .dc_near_battery = battery_voltage_is_near(&voltages),
        .dc_contradicts = battery_voltage_contradicts(&ecu->battery_voltage, &voltages),
        .sensors_plausible = are_sensors_plausible(drive, sample),
        .angle_absolute = hal_angle_is_absolute(),
        .angle_imposed = drive_imposes_angle(drive),
        .slow = is_slow(drive),
        .derated = derating_reason(ecu) != DERATING_REASON_NONE,
        .movement_ended = drive_has_ended_movement(drive),
        .gate_fault = gate_fault,
        .task_late = ecu->liveness.late_in_a_row >= CONSECUTIVE_MAX,
        .stalled = ecu->liveness.stalled_in_a_row >= CONSECUTIVE_MAX,
        .shut_off_tested = ecu->shut_off.tested,
        .shut_off_faults = ecu->shut_off.faults,
        .elapsed_us = ecu->clock.elapsed_us,
    };
}

arbitrate_in_t ecu_arbitration(const ecu_t *ecu)
{
    const commanded_t *commanded = &ecu->commanded;
    const supervisor_t *supervisor = &ecu->supervisor;
    /* At most the rated torque: a ramp to zero from a larger value would reach the machine late. */
    const q15_t max = are_limits_lost(ecu) ? (q15_t)0 : ecu->drive.motor->torque_max;
    return (arbitrate_in_t){
        .torque_requested = commanded->torque_requested,
        .limit_drive = fx_clamp_q15(commanded->limit_drive, 0, max),
        .limit_regen = fx_clamp_q15(commanded->limit_regen, 0, max),
        .omega = sample_box_last(&ecu->drive.samples)->point.omega,
        .run = supervisor_outputs[supervisor->state].run,
        .stop = !supervisor->enabled,
        .ramp_out = !ecu->rx.command_channel.alive || supervisor->faults != 0U,
    };
}

/* The limit that the request exceeds. A frame with a value out of the DBC's ranges is counted in RangeErrors and not
 * used. */
static request_limit_t request_limit(const ecu_t *ecu)
{
    const bus_command_t *command = &ecu->rx.command;
    const float requested_Nm = command->torque_requested_Nm;
    const float magnitude_Nm = (requested_Nm < 0.0F) ? -requested_Nm : requested_Nm;
    const q31_t omega = sample_box_last(&ecu->drive.samples)->point.omega;
    const bool braking = arbitrate_is_braking(&ecu->arbitration_config, omega, requested_Nm < 0.0F);
    const float half_count_Nm = 0.5F * ecu->drive.motor->bus_scales.torque_Nm; /* the bus rounds the rated torque */
    if (magnitude_Nm > ecu->drive.motor->torque_max_Nm + half_count_Nm) {
        return REQUEST_LIMIT_RATED_TORQUE;
    }
    if (magnitude_Nm > (braking ? command->limit_regen_Nm : command->limit_drive_Nm)) {
        return REQUEST_LIMIT_VEHICLE_LIMIT;
    }
    return ((ecu->drive.task.derating & DERATING_REACH) != 0U) ? REQUEST_LIMIT_REACH : REQUEST_LIMIT_NONE;
}

void ecu_telemetry(const ecu_t *ecu, telemetry_t *telemetry)
{
    const supervisor_t *s = &ecu->supervisor;
    telemetry->state = s->state;
    telemetry->ecu_faults = s->faults;
    telemetry->first_fault = s->first_fault;
    telemetry->fault_count = s->fault_count;
    telemetry->refused_reason = s->refused;
    telemetry->refused_count = s->refused_count;
    telemetry->derating_reason = derating_reason(ecu);
    if (can_tx_may_send_limits(&ecu->tx)) {
        telemetry->request_limit = (uint32_t)request_limit(ecu);
    }
}
