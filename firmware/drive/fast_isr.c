/* SPDX-License-Identifier: Apache-2.0 */
/* One PWM period, from converter counts to duties:
 *
 *   counts, angle -> acquire_sample -> to_rotor_frame -> current control -> modulation -> duties
 *                                                                        -> publish_sample -> identification
 *
 * Three routes lead through it. The usual one (the bridge runs, nothing is latched, counted or out of its limits) skips
 * the monitors' counters, the start of the angle tracker and the enabling of the outputs: about 60 instructions.
 *   usual        fast_isr(): the order of the block diagram, written here once
 *   not settled  run_period_not_settled(): the bridge is disabled or was just enabled, or a fault or counter is pending
 *   checked      run_period_checked(): a sample is out of its limits; also the second part of the route above
 * A motor whose field turns far in a period (current_control_turning.h) always takes the second one.
 * tests/unit/drive/test_fast_isr.c shows that the routes agree. */
#include "control/current/transform.h"
#include "drive/acquire.h"
#include "drive/drive.h"
#include "drive/publish.h"
#include "drive/short_circuit.h"
#include "drive/turning_modulate.h"
#include "fx/codegen.h"
#include "hal/pwm.h"

#define PERIODS_TO_ACT 3 /* from enabling until the voltage of the whole last period is known */

/* rotation: of the sample's angle; advanced: where the duties will act; angle_step: 2^32 = one turn; v_dc: q15. */
typedef struct {
    fx_pair_t i_dq, rotation, advanced;
    int32_t v_dc;
    int32_t angle_step;
} rotor_frame_t;

/* Current control starts anew; task and identification are informed that no voltage of the drive acts. */
static void reset_control(drive_t *drive, sample_t *sample)
{
    current_control_reset(&drive->fast.current_control);
    turning_control_reset(&drive->fast.turning_control, &sample->point.flux);
    sample->acting = false;
    identify_window_invalidate(&drive->fast.window);
    drive->fast.periods_since_enable = 0;
}

/* The safe state: all switches of one side on (short circuit), or switching disabled (freewheel). */
static void apply_safe_state(drive_t *drive, sample_t *sample, const command_t *command, const safe_period_t *now)
{
    if (short_circuit_may_begin(drive, now) && short_circuit_is_needed(&drive->fast, command->safe)) {
        short_circuit_step(drive, now, command->upper);
    } else {
        short_circuit_end(&drive->fast);
    }
    reset_control(drive, sample);
    sample->point.u = (dq_q15_t){0, 0};
    sample->voltage_limited = false;
    sample->pulses_clamped = false;
    drive->fast.u_next = (dq_q15_t){0, 0};
}

/* The voltage circle or a pulse limit is active: the voltage of the next period follows from the duties. */
static inline FX_INLINED void recompute_voltage(drive_t *drive, sample_t *sample, const modulate_config_t *config,
                                                modulate_out_t made, fx_pair_t i, fx_pair_t advanced)
{
    if (made.limited != 0U) {
        sample->pulses_clamped = true;
        identify_window_count_limited(&drive->fast.window);
    }
    drive->fast.u_next = modulate_applied(config, &made.duty, i, advanced, sample->v_dc);
}

static FX_NOT_INLINED FX_INLINES_CALLS void voltage_from_duties(drive_t *drive, sample_t *sample, modulate_out_t made,
                                                                fx_pair_t i, fx_pair_t advanced)
{
    recompute_voltage(drive, sample, &drive->parameters.modulate, made, i, advanced);
}

/* The duties of the first period act in the second; the third sample ends a period whose duties are known. */
static void count_since_enable(fast_state_t *fast, sample_t *sample)
{
    if (fast->periods_since_enable < PERIODS_TO_ACT) {
        fast->periods_since_enable++;
    }
    sample->acting = fast->periods_since_enable >= PERIODS_TO_ACT;
    if (!sample->acting) {
        identify_window_invalidate(&fast->window);
    }
}

static current_control_in_t control_inputs(const sample_t *sample, const rotor_frame_t *now,
                                           const current_target_t *target)
{
    return (current_control_in_t){target, &sample->point.flux, now->v_dc};
}

/* Current control of a motor whose field turns far in a period. */
static FX_NOT_INLINED FX_COLD current_control_out_t control_turning(drive_t *drive, const sample_t *sample,
                                                                    const rotor_frame_t *now,
                                                                    const current_target_t *target)
{
    const turning_control_in_t in = {control_inputs(sample, now, target), sample->point.i, now->angle_step,
                                     drive->psi_d_error};
    return turning_control_step(&drive->motor->turning_control, &drive->parameters.current_control,
                                &drive->fast.turning_control, &in);
}

/* Modulation -> duties. The voltage that acts now was computed a period ago. turning: NULL on the usual route. */
static inline FX_INLINED void write_duties(drive_t *drive, sample_t *sample, const rotor_frame_t *now,
                                           current_control_out_t wanted, const modulate_config_t *turning)
{
    fast_state_t *fast = &drive->fast;
    const motor_parameters_t *p = &drive->parameters;
    sample->point.u.d = fast->u_next.d;
    sample->point.u.q = fast->u_next.q;
    sample->acting = true;
    sample->voltage_limited = false;
    sample->pulses_clamped = false;
    sample->fx_padding_flag = false;
    fast->u_next.d = wanted.u.d;
    fast->u_next.q = wanted.u.q;
    const modulate_config_t *modulate = (turning != NULL) ? turning : &p->modulate;
    duty_t duty;
    if (wanted.clear) {
        duty = modulate_clear(modulate, wanted.v, now->i_dq, now->advanced);
    } else {
        const modulate_out_t made = modulate_step(modulate, wanted.v, now->i_dq, now->advanced);
        duty = made.duty;
        if ((made.limited | wanted.limited) != 0U) {
            sample->voltage_limited = wanted.limited != 0U;
            if (turning != NULL) {
                recompute_voltage(drive, sample, turning, made, now->i_dq, now->advanced);
            } else {
                voltage_from_duties(drive, sample, made, now->i_dq, now->advanced);
            }
        }
    }
    hal_pwm_write(duty);
}

static FX_NOT_INLINED FX_COLD void write_duties_turning(drive_t *drive, sample_t *sample, const rotor_frame_t *now,
                                                        const current_control_out_t *wanted)
{
    const modulate_config_t modulate = turning_modulate(&drive->parameters.modulate,
                                                        drive->motor->turning_control.knee_turns_q27, now->angle_step);
    write_duties(drive, sample, now, *wanted, &modulate);
}

/* Current control -> modulation -> duties. */
static inline FX_INLINED void control_currents(drive_t *drive, sample_t *sample, const rotor_frame_t *now,
                                               const current_target_t *target)
{
    const current_control_in_t in = control_inputs(sample, now, target);
    write_duties(drive, sample, now,
                 current_control_step(&drive->parameters.current_control, &drive->fast.current_control, &in), NULL);
}

/* Called before the monitors of this period, which latch a fault again at once if its cause persists. The task never
 * sends a reset together with the command to run. Invalid motor data cannot be reset. */
static void reset_faults(drive_t *drive, uint32_t requested)
{
    if (drive->fast.fault_resets != requested) {
        drive->fast.fault_resets = requested;
        drive->fast.faults = drive->fast.faults & FAULT_CONFIG;
        short_circuit_reset(&drive->fast);
    }
}

/* Park and the flux tables; if duties follow, the angle 1.5 periods ahead, in the middle of the period they act in. */
static inline FX_INLINED rotor_frame_t to_rotor_frame(drive_t *drive, sample_t *sample, int32_t step, bool drives)
{
    const fx_pair_t rotation = fx_rotation(sample->theta_e);
    const dq_q15_t measured = park_pair(sample->i_ab, rotation);
    sample->point.i = measured;
    const uint32_t ahead = (uint32_t)step + (uint32_t)(step >> 1);
    const fx_pair_t advanced = drives ? fx_rotation(sample->theta_e + ahead) : 0U;
    sample->point.flux = flux_table_step(&drive->period.flux_table, measured);
    return (rotor_frame_t){fx_pair(measured.d, measured.q), rotation, advanced, sample->v_dc, step};
}

/* During the pulses only the monitors of the samples act: there is no identification and no slow monitor. */
static FX_NOT_INLINED FX_COLD void apply_pulses(drive_t *drive, sample_t *sample, const rotor_frame_t *now)
{
    const dq_q15_t v = pulses_step(&drive->pulses, &drive->pulses_state, sample->point.i, sample->theta_e);
    write_duties(drive, sample, now, pulses_voltage(v, drive->parameters.modulate.alpha_q31, now->v_dc), NULL);
    reset_control(drive, sample);
}

static FX_NOT_INLINED FX_COLD void control_checked(drive_t *drive, sample_t *sample, const rotor_frame_t *now,
                                                   const current_target_t *target)
{
    if (turning_control_used(&drive->motor->turning_control)) {
        const current_control_out_t wanted = control_turning(drive, sample, now, target);
        write_duties_turning(drive, sample, now, &wanted);
    } else {
        control_currents(drive, sample, now, target);
    }
    count_since_enable(&drive->fast, sample);
}

static FX_NOT_INLINED FX_COLD void run_period_checked(drive_t *drive, sample_t *sample, int32_t angle_step)
{
    const command_t *command = command_box_read(&drive->commands);
    fast_state_t *fast = &drive->fast;
    const abc_q15_t i = acquire_check(drive, sample, command->run != (uint8_t)BRIDGE_OFF);
    const bool runs = command->run != (uint8_t)BRIDGE_OFF && fast->faults == 0U;
    const rotor_frame_t now = to_rotor_frame(drive, sample, angle_step, runs);
    if (runs) {
        if ((command->run & (uint8_t)BRIDGE_PULSES) != 0U) {
            apply_pulses(drive, sample, &now);
        } else {
            control_checked(drive, sample, &now, &command->target);
        }
        hal_pwm_enable(true);
        short_circuit_prepare(fast, drive->period.periods_per_step / 2U);
    } else {
        if (command->faults != 0U) {
            drive_raise_fault(drive, command->faults);
        }
        apply_safe_state(drive, sample, command, &(safe_period_t){sample, i, now.rotation, now.angle_step});
    }
    fast->is_settled = fast->periods_since_enable >= PERIODS_TO_ACT && fast->monitor.pending == 0U &&
                       !turning_control_used(&drive->motor->turning_control);
    publish_sample(drive, sample);
}

static FX_NOT_INLINED FX_COLD void run_period_not_settled(drive_t *drive)
{
    const command_t *command = command_box_read(&drive->commands);
    if (command->run == (uint8_t)BRIDGE_OFF) {
        reset_faults(drive, command->fault_resets);
    }
    sample_t *sample = sample_box_begin(&drive->samples);
    const int32_t own_step = acquire_sample(drive, sample, false).angle_step;
    run_period_checked(drive, sample, drive_take_frame(drive, command, sample, own_step));
}

/* The usual period. With link-time optimisation all of its stages are compiled into this function. */
FX_INLINES_CALLS void fast_isr(drive_t *drive)
{
    const command_t *command = command_box_read(&drive->commands);
    if (((uint8_t)drive->fast.is_settled & command->run) == 0U) {
        run_period_not_settled(drive);
        return;
    }
    sample_t *sample = sample_box_begin(&drive->samples);
    const acquired_t acquired = acquire_sample(drive, sample, true);
    if (!acquired.within_limits) {
        run_period_checked(drive, sample, acquired.angle_step);
        return;
    }
    const rotor_frame_t now = to_rotor_frame(drive, sample, acquired.angle_step, true);
    control_currents(drive, sample, &now, &command->target);
    publish_sample(drive, sample);
}
