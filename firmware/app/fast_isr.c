/* SPDX-License-Identifier: Apache-2.0 */
#include "app/drive.h"
#include "app/hand_over.h"
#include "app/take_sample.h"
#include "control/transform.h"
#include "hal/pwm.h"

#define DUTY_MIDDLE 16384
#define PERIODS_TO_ACT 3

/* What current control and modulation need besides the sample. */
typedef struct {
    fx_pair_t i_dq, advanced;
    int32_t v_dc;
    q31_t omega;
} instant_t;

/* The safe state: low sides closed, or all gates open. */
static void bridge_off(drive_t *drive, sample_t *sample, safe_t safe)
{
    const bool over_voltage = (drive->fast.faults & FAULT_OVER_VOLTAGE) != 0U;
    const bool closed = safe == SAFE_SHORT_CIRCUIT || (safe == SAFE_SHORT_ON_OVER_VOLTAGE && over_voltage);
    const uint16_t duty = closed ? 0U : DUTY_MIDDLE;
    if (!closed) {
        hal_pwm_enable(false);
    }
    hal_pwm_write((duty_t){duty, duty, duty});
    if (closed) {
        hal_pwm_enable(true); /* with the duties, not before them */
    }
    current_control_reset(&drive->fast.current_control);
    sample->mrai.u = (dq_t){0, 0};
    sample->voltage_limited = false;
    sample->snapped = false;
    sample->acting = false;
    identify_window_spoil(&drive->fast.window);
    drive->fast.coming = (dq_t){0, 0};
    drive->fast.periods_on = 0;
}

/* Circle or hexagon: what the bridge makes, and the voltage to come, may not be what is wanted. */
static __attribute__((noinline, flatten)) void bridge_limited(drive_t *drive, sample_t *sample, modulate_out_t made,
                                                              fx_pair_t i, fx_pair_t advanced)
{
    if (made.limited != 0U) {
        sample->snapped = true;
        identify_window_snapped(&drive->fast.window);
    }
    drive->fast.coming = modulate_acted(&drive->motor.modulate, made.duty, i, advanced, sample->v_dc);
}

/* The duties of the first period act in the second; the third sample ends a period of which they are known. */
static void starting(fast_state_t *fast, sample_t *sample)
{
    if (fast->periods_on < PERIODS_TO_ACT) {
        fast->periods_on++;
    }
    sample->acting = fast->periods_on >= PERIODS_TO_ACT;
    if (!sample->acting) {
        identify_window_spoil(&fast->window);
    }
}

static void bridge_on(drive_t *drive, sample_t *sample, const instant_t *now, const current_target_t *target)
{
    fast_state_t *fast = &drive->fast;
    const motor_t *m = &drive->motor;
    const current_control_in_t control = {
        .target = target,
        .flux = &sample->mrai.flux,
        .omega = now->omega,
        .psi_delta = drive_psi_delta(drive),
        .v_dc = now->v_dc,
    };
    const current_control_out_t wanted = current_control_step(&m->current_control, &fast->current_control, &control);
    sample->mrai.u.d = fast->coming.d; /* acts now: the duties before these */
    sample->mrai.u.q = fast->coming.q;
    sample->acting = true;
    sample->voltage_limited = false;
    sample->snapped = false;
    fast->coming.d = wanted.u.d;
    fast->coming.q = wanted.u.q;
    duty_t duty;
    if (__builtin_expect(wanted.clear, 1)) {
        duty = modulate_clear(&m->modulate, wanted.v, now->i_dq, now->advanced);
    } else {
        const modulate_out_t made = modulate_step(&m->modulate, wanted.v, now->i_dq, now->advanced);
        duty = made.duty;
        if ((made.limited | wanted.limited) != 0U) {
            sample->voltage_limited = wanted.limited != 0U;
            bridge_limited(drive, sample, made, now->i_dq, now->advanced);
        }
    }
    hal_pwm_write(duty);
}

/* A reset comes before this period's monitors: what is still wrong is latched again at once. It never comes with the
 * command to run. Bad motor data stay bad. */
static void forget_faults(drive_t *drive, uint32_t asked)
{
    if (drive->fast.fault_resets != asked) {
        drive->fast.fault_resets = asked;
        drive->fast.faults = drive->fast.faults & FAULT_CONFIG;
    }
}

/* The phases are found from the vector again: seldom. */
static void look(drive_t *drive, const sample_t *sample, bool run)
{
    const monitor_in_t seen = {measure_phases(sample->i_ab, sample->zero_q28), sample->v_dc};
    const uint32_t faults = monitor_step(&drive->motor.monitor, &drive->fast.monitor, &seen);
    if (seen.v_dc < drive->motor.monitor.v_min) {
        drive->fast.periods_on = 0; /* down there nobody knows what acts: as after switching on */
    }
    /* An unpowered bridge may see no dc voltage; what opens the gates while they are closed is a fault at any time. */
    if (faults != 0) {
        drive_raise_fault(drive, run ? faults : faults & ~(uint32_t)FAULT_UNDER_VOLTAGE);
    }
}

/* The frame of the rotor, the tables, and what current control works with. */
static instant_t turn(drive_t *drive, sample_t *sample, const seen_t *seen)
{
    const dq_t measured = park_pair(sample->i_ab, fx_rotation(sample->theta_e));
    sample->mrai.i = measured;
    /* The middle of the period in which the duties will act: 1.5 periods ahead. */
    const uint32_t ahead = (uint32_t)seen->step + (uint32_t)(seen->step >> 1);
    const fx_pair_t advanced = fx_rotation(sample->theta_e + ahead);
    sample->mrai.flux = flux_table_step(&drive->motor.flux_table, measured);
    /* From the sample again: held in registers it would be put aside on the stack, too. */
    const fx_arch_two_t i = fx_arch_load_two(&sample->mrai.i.d);
    return (instant_t){fx_arch_pkhbt(i.first, i.second), advanced, seen->v_dc, sample->mrai.omega};
}

/* A period in which something is not as it should be, was not a moment ago, or in which the bridge does not run. */
static __attribute__((noinline, cold)) void carefully(drive_t *drive, sample_t *sample, int32_t step)
{
    const command_t *command = command_box_read(&drive->commands);
    fast_state_t *fast = &drive->fast;
    const seen_t seen = {step, sample->v_dc, false};
    if (drive->samples.generation == drive->slow.finished) {
        fast->overruns_in_a_row = 0;
    }
    look(drive, sample, command->run);
    const instant_t now = turn(drive, sample, &seen);
    if (command->run && fast->faults == 0) {
        bridge_on(drive, sample, &now, &command->target);
        hal_pwm_enable(true);
        starting(fast, sample);
    } else {
        if (command->faults != 0U) {
            drive_raise_fault(drive, command->faults);
        }
        bridge_off(drive, sample, command->safe);
    }
    fast->settled = fast->periods_on >= PERIODS_TO_ACT && fast->overruns_in_a_row == 0 && fast->monitor.attention == 0;
    hand_over(drive, sample, drive->samples.generation + (sample == &fast->lost ? 0U : 1U));
}

/* The bridge does not run or has just begun to, a fault is latched, something is being counted, or the identification
 * is late. */
static __attribute__((noinline, cold)) void unsettled(drive_t *drive)
{
    const command_t *command = command_box_read(&drive->commands);
    const uint32_t published = drive->samples.generation;
    const uint32_t unfinished = published - drive->slow.finished;
    sample_t *sample = sample_box_begin(&drive->samples, published + 1U);
    if (!command->run) {
        forget_faults(drive, command->fault_resets);
    }
    if (unfinished != 0U && hand_over_late(drive, unfinished)) {
        sample = &drive->fast.lost; /* the identification still reads the slot whose turn it is */
    }
    const seen_t seen = take_sample(drive, sample, false);
    carefully(drive, sample, seen.step);
}

/* Everything the usual period needs is compiled into the one interrupt, with a compiler that sees all files. */
__attribute__((flatten)) void fast_isr(drive_t *drive)
{
    const command_t *command = command_box_read(&drive->commands);
    const uint32_t published = drive->samples.generation;
    if (__builtin_expect(published != drive->slow.finished || !(drive->fast.settled & command->run), 0)) {
        unsettled(drive);
        return;
    }
    sample_t *sample = sample_box_begin(&drive->samples, published + 1U);
    const seen_t seen = take_sample(drive, sample, true);
    if (__builtin_expect(!seen.calm, 0)) {
        carefully(drive, sample, seen.step);
        return;
    }
    const instant_t now = turn(drive, sample, &seen);
    bridge_on(drive, sample, &now, &command->target);
    hand_over(drive, sample, drive->samples.generation + 1U);
}
