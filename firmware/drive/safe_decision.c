/* SPDX-License-Identifier: Apache-2.0 */
#include "drive/safe_decision.h"

#define QUARTER_PER_PHASES Q15(0.25 / 1.5) /* a quarter of i_max in the dc link, as power of the three phases */

/* Whether the measured currents are the machine's. The current sum of this sample counts, not the latched fault: in the
 * first milliseconds of a short circuit the converters saturate, which latches that fault. */
static bool currents_valid(const drive_t *drive, const snapshot_t *snapshot)
{
    return (snapshot->faults & (FAULT_CURRENT_STUCK | FAULT_PHASE_LOST | FAULT_INPUT)) == 0U &&
           drive_currents_add_up(drive, &snapshot->sample);
}

/* With the known speed of the last step. */
static gate_fault_in_t gate_fault_inputs(const drive_t *drive, const snapshot_t *snapshot)
{
    const safe_state_state_t *safe = &drive->task.safe_state;
    return (gate_fault_in_t){
        .latched = (snapshot->faults & FAULT_GATE) != 0U,
        .gates = snapshot->gates,
        .rectifies = safe->rectifies,
        .currents_valid = currents_valid(drive, snapshot),
        .line_emf = safe->line_emf,
        .v_dc = (q15_t)snapshot->sample.v_dc,
        .zero = drive_mean_of_phases(&snapshot->sample),
        .i_magnitude = snapshot->i_magnitude,
    };
}

/* The machine feeds more than a quarter of i_max into the dc link: it would be the cause of an over-voltage, and the
 * voltage would rise further while the diodes end the currents (SS-18). After another fault they already do. */
static bool charges_link(const drive_t *drive, const snapshot_t *snapshot)
{
    const operating_point_t *point = &snapshot->sample.point;
    const int32_t torque = fx_mul_q15((q15_t)point->flux.psi_d, (q15_t)point->i.q) -
                           fx_mul_q15((q15_t)point->flux.psi_q, (q15_t)point->i.d);
    const int32_t power = fx_mul_q15(fx_sat_q15(torque), fx_q15_from_q31(point->omega));
    const int32_t power_max = fx_mul_q15((q15_t)snapshot->sample.v_dc, drive->motor->current_reference.i_max);
    return power < -fx_mul_q15(QUARTER_PER_PHASES, (q15_t)power_max);
}

/* Switching that is disabled below the speed level of the short circuit stays disabled, even if the speed exceeds that
 * level in the same step: only a short circuit that an earlier step decided keeps the permission. */
static bool is_armed(const task_state_t *task, bool holds_short_circuit, uint32_t faults)
{
    return task->run_state == RUN_STATE_RUN || (task->armed && (holds_short_circuit || faults != 0U));
}

/* During a movement the magnet's flux is only estimated roughly. With too large an estimate a slow machine would be
 * short-circuited without need. 30 % of the largest speed are below the speed at which the diodes conduct. */
static bool is_magnet_unknown(const task_state_t *task)
{
    return task->movement.phase != MOVEMENT_PHASE_IDLE;
}

/* The faults that would bring the short circuit, in the period in which they occur. */
static safe_t on_faults(bool gate_fault, bool over_voltage)
{
    if (over_voltage) {
        return gate_fault ? SAFE_SHORT_ON_EITHER : SAFE_SHORT_ON_OVER_VOLTAGE;
    }
    return gate_fault ? SAFE_SHORT_ON_GATE_FAULT : SAFE_FREEWHEEL;
}

safe_t safe_decision_step(drive_t *drive, const snapshot_t *snapshot)
{
    task_state_t *task = &drive->task;
    const uint32_t faults = snapshot->faults;
    const bool over_voltage = (faults & FAULT_OVER_VOLTAGE) != 0U;
    const operating_point_t *point = &snapshot->sample.point;
    const gate_fault_config_t *gate_config = &drive->motor->gate_fault;
    const gate_fault_in_t gate = gate_fault_inputs(drive, snapshot);
    const safe_state_in_t in = {
        .omega = fx_q15_from_q31(point->omega),
        .psi_d_error = snapshot->psi_d_error,
        .v_dc = (q15_t)snapshot->sample.v_dc,
        .i = point->i,
        .i_last_period = snapshot->i_last_period,
        .psi_current = {point->flux.psi_d - point->flux.psi_f0, point->flux.psi_q},
        .shorted = snapshot->shorted,
        .currents_valid = gate.currents_valid,
        .speed_valid = (faults & (FAULT_ANGLE | FAULT_INPUT)) == 0U,
        .doubtful = faults != 0U || task->plausibility.reference != 0U,
        .rectifying = gate_fault_current_flows(gate_config, &gate),
        .over_voltage = over_voltage && snapshot->shorted,
    };
    const bool was_short_circuit = task->safe_state.short_circuit;
    const bool by_gate = gate_fault_step(gate_config, &task->gate_fault, &gate);
    const bool fast = safe_state_step(&drive->motor->safe_state, &task->safe_state, &in);
    const bool by_speed = fast && !is_magnet_unknown(task);
    const bool short_circuit = by_speed || (by_gate && (faults & FAULT_GATE) != 0U);
    task->armed = is_armed(task, short_circuit && was_short_circuit, faults);
    if (!task->armed) {
        return SAFE_FREEWHEEL;
    }
    if (short_circuit) {
        return SAFE_SHORT_CIRCUIT;
    }
    return on_faults(by_gate, faults == 0U && charges_link(drive, snapshot));
}

bool safe_decision_is_upper(const drive_t *drive)
{
    return short_side_is_upper(&drive->task.short_side, drive->motor->plausibility.i_dead);
}
