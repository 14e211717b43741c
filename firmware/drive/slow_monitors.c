/* SPDX-License-Identifier: Apache-2.0 */
#include "drive/slow_monitors.h"

#include "control/current/transform.h"
#include "drive/gain_jump_check.h"
#include "fx/codegen.h"

static inline FX_INLINED_IF_OPTIMISED abc_q15_t in_phases(dq_q15_t i, uint32_t theta_e)
{
    const ab_q30_t q30 = inverse_park_q30(i, fx_rotation(theta_e));
    const int32_t alpha = transform_round(q30.alpha);
    const abc_t x = inverse_clarke(alpha, fx_mul_q15((q15_t)transform_round(q30.beta), Q15(SQRT3_HALF)));
    return (abc_q15_t){x.a, x.b, x.c};
}

/* Phase currents of the newest sample, and the reference at its angle. */
typedef struct {
    abc_q15_t measured, reference;
} phase_currents_t;

static uint8_t gate_exceeded_steps(const drive_t *drive, const snapshot_t *snapshot)
{
    return snapshot->mrai_is_chosen ? 0U : (uint8_t)(IDENTIFY_STEPS * drive->task.identify.gate_exceeded_updates);
}

/* A rotor that stands induces nothing, and a bridge that does not switch makes no voltage. */
static bool is_at_rest(const snapshot_t *snapshot)
{
    return !snapshot->sample.acting && !snapshot->gates && drive_stands_still(snapshot->sample.point.omega);
}

static uint32_t check_currents(drive_t *drive, const snapshot_t *snapshot, const phase_currents_t *phases,
                               q15_t u_behind)
{
    const sample_t *sample = &snapshot->sample;
    task_state_t *task = &drive->task;
    const plausibility_config_t *config = &drive->motor->plausibility;
    const bool at_once = config->answer_rate == Q15_MAX;
    const dq_q15_t expected = plausibility_expected(config, &task->plausibility, task->i_ref);
    const plausibility_in_t in = {
        .acting = sample->acting,
        .at_rest = is_at_rest(snapshot),
        .voltage_limited = sample->voltage_limited,
        .i = sample->point.i,
        .i_ref = task->i_ref,
        .i_mean = snapshot->i_mean,
        .u_behind = u_behind,
        .phases = phases->measured,
        .phases_ref = at_once ? phases->reference : in_phases(expected, sample->theta_e),
        .omega = fx_q15_from_q31(sample->point.omega),
        .inverter_dC = snapshot->inverter_dC,
        .winding_dC = snapshot->winding_dC,
        .known_permille = snapshot->known_permille,
        .gate_exceeded_steps = gate_exceeded_steps(drive, snapshot),
    };
    return plausibility_step(config, &task->plausibility, &in);
}

static uint32_t check_torque(drive_t *drive, const snapshot_t *snapshot, winding_resistance_t r)
{
    const sample_t *sample = &snapshot->sample;
    task_state_t *task = &drive->task;
    const torque_monitor_in_t in = {
        .acting = sample->acting && !drive_bypasses_torque_path(drive),
        .u = sample->point.u,
        .u_mean = snapshot->u_mean,
        .i = sample->point.i,
        .psi = {sample->point.flux.psi_d, sample->point.flux.psi_q},
        .omega = fx_q15_from_q31(sample->point.omega),
        .current = snapshot->i_magnitude,
        .torque = fx_q15_from_q31(task->torque_loop.model),
        .r = r,
    };
    return torque_monitor_step(&drive->motor->torque_monitor, &task->torque_monitor, &in);
}

static q15_t least_of(abc_q15_t i)
{
    return (q15_t)fx_min_s32(fx_min_s32(fx_abs_q31(i.a), fx_abs_q31(i.b)), fx_abs_q31(i.c));
}

/* A new compensation changes the voltages even if the rotor does not move: comparisons with earlier ones restart. */
static bool is_compensation_new(drive_t *drive)
{
    const int32_t dead_time_q16 = drive->parameters.modulate.dead_time_q16;
    const bool is_new = dead_time_q16 != drive->task.monitored_dead_time_q16;
    drive->task.monitored_dead_time_q16 = dead_time_q16;
    return is_new;
}

static uint32_t check_angle(drive_t *drive, const snapshot_t *snapshot, abc_q15_t phases_ref, bool acting, bool behind)
{
    const identify_window_t *window = &snapshot->window;
    task_state_t *task = &drive->task;
    const frozen_angle_in_t in = {
        .acting = acting,
        .behind = behind,
        .u_sum = window->sum_u,
        .i_ref = task->i_ref,
        .psi_ref = task->psi_ref,
        .i_phase_min = acting ? least_of(phases_ref) : (q15_t)0,
        .theta_e = snapshot->sample.theta_e,
    };
    return frozen_angle_step(&drive->motor->frozen_angle, &task->frozen_angle, &in);
}

/* The field turns by more than a quarter of a turn in a step. Then the angles at the steps do not show whether the
 * angle stands still: they are also equal if it advances by a whole number of turns per step. */
static bool is_fast(uint64_t turns_q60)
{
    return turns_q60 > (1ULL << 58);
}

/* Turns of the field in a step. */
static uint64_t turns_of_step_q60(const drive_t *drive, q31_t omega)
{
    return (uint64_t)fx_abs_q31(omega) * drive->motor->identify.window_turns_q29;
}

static bool is_near_reference(const drive_t *drive, dq_q15_t i)
{
    const dq_q15_t i_ref = drive->task.i_ref;
    const int32_t i_0 = drive->motor->torque_monitor.i_0;
    return fx_abs_q31(i.d - i_ref.d) < i_0 && fx_abs_q31(i.q - i_ref.q) < i_0;
}

/* With a broken lead both the sample and the mean of the step deviate from the current reference, and the power is not
 * that of the reference either. With a wrong angle only single samples may deviate, because the currents oscillate
 * about their reference; after a jump of a sensor's gain only the mean of one step does. */
static bool is_controlled(const drive_t *drive, const snapshot_t *snapshot)
{
    return is_near_reference(drive, snapshot->sample.point.i) || is_near_reference(drive, snapshot->i_mean);
}

/* A prediction replaces a sample that no rotor can have (AT-14), and a rotor that stops within milliseconds may look
 * like one (AT-17), until (AT-18) or the fault of (MN-21): while the currents follow the prediction, their power says
 * nothing about the sensor. */
static bool is_angle_measured(const drive_t *drive, const sample_t *sample)
{
    const angle_tracker_config_t *tracker = &drive->period.angle_tracker;
    return sample->theta_e == sample->theta_m * tracker->pole_pairs + tracker->offset;
}

/* Called after check_angle(), which removes the voltage of the changing flux. */
static uint32_t check_launch(drive_t *drive, const snapshot_t *snapshot, bool acting, bool behind,
                             winding_resistance_t r)
{
    task_state_t *task = &drive->task;
    const launch_power_in_t in = {
        .acting = acting && is_controlled(drive, snapshot),
        .behind = behind,
        .measured = is_angle_measured(drive, &snapshot->sample),
        .u_standing = task->frozen_angle.u_standing,
        .i_ref = task->i_ref,
        .psi_ref = task->psi_ref,
        .theta_e = snapshot->window.last.theta,
        .r = r,
    };
    return launch_power_step(&drive->motor->launch_power, &task->launch_power, &in);
}

/* The second harmonic of a half wave turns by almost a whole number of turns in half a step, or hardly at all: it would
 * look constant. */
static bool is_second_harmonic_constant(uint64_t turns_q60)
{
    const uint64_t part = (turns_q60 + (1ULL << 55)) & ((1ULL << 60) - 1U);
    return part < 1ULL << 56; /* within 1/32 of a turn */
}

static void count_in_short_side(drive_t *drive, const snapshot_t *snapshot, const phase_currents_t *phases, bool counts)
{
    const short_side_in_t in = {
        .acting = counts,
        .shorted = snapshot->shorted || snapshot->faults != 0U,
        .i = phases->measured,
        .i_ref = phases->reference,
    };
    short_side_step(&drive->task.short_side, &in);
}

/* Finds no fault: it decides by which side a short circuit would be made if a fault occurred now. While a fault is
 * latched or the short circuit is on, the decision of the last step before it is kept: switching is disabled first.
 * Half a step lies between two samples, so that the second harmonic of a half wave, which may turn by a whole turn in a
 * step, does not look constant. */
static void update_short_side(drive_t *drive, const snapshot_t *snapshot, const phase_currents_t *phases,
                              uint64_t turns_q60)
{
    const bool constant = is_second_harmonic_constant(turns_q60);
    const uint32_t half_step = drive->period.periods_per_step / 2U;
    const sample_t *before = sample_box_at(&drive->samples, snapshot->generation - half_step);
    if (before->acting) {
        const phase_currents_t earlier = {measure_phases(before->i_ab, before->zero_q28),
                                          in_phases(drive->task.i_ref, before->theta_e)};
        count_in_short_side(drive, snapshot, &earlier, !constant);
    }
    count_in_short_side(drive, snapshot, phases, snapshot->sample.acting && !constant);
}

uint32_t slow_monitors_step(drive_t *drive, const snapshot_t *snapshot)
{
    const uint32_t shorted = drive->task.gate_fault.switch_shorted ? (uint32_t)FAULT_GATE : 0U; /* found last step */
    const phase_currents_t phases = {measure_phases(snapshot->sample.i_ab, snapshot->sample.zero_q28),
                                     in_phases(drive->task.i_ref, snapshot->sample.theta_e)};
    const bool comparable = !is_compensation_new(drive) && !snapshot->mrai_is_chosen && snapshot->window.acting &&
                            snapshot->sample.acting;
    const uint64_t turns_q60 = turns_of_step_q60(drive, snapshot->sample.point.omega);
    const bool acting = comparable && !is_fast(turns_q60);
    const q15_t u_behind = torque_monitor_missing_voltage(snapshot->lag, drive->task.psi_ref);
    const uint32_t of_currents = check_currents(drive, snapshot, &phases, u_behind);
    if (drive_is_moving(drive)) { /* with the angle of a movement, comparisons with the motor data have no meaning */
        return (of_currents & (FAULT_TEMPERATURE | FAULT_OVER_SPEED | FAULT_INPUT | FAULT_CURRENT_STUCK)) | shorted;
    }
    const bool behind = u_behind > drive->motor->torque_monitor.v_lag;
    const winding_resistance_t r = torque_monitor_resistance(&drive->motor->torque_monitor, snapshot->winding_dC);
    uint32_t faults = of_currents | shorted | gain_jump_check(drive, snapshot, comparable, r);
    faults |= check_torque(drive, snapshot, r);
    faults |= check_angle(drive, snapshot, phases.reference, acting, behind);
    faults |= check_launch(drive, snapshot, acting, behind, r);
    update_short_side(drive, snapshot, &phases, turns_q60);
    return faults;
}
