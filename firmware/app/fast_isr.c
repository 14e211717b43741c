/* SPDX-License-Identifier: Apache-2.0 */
#include "app/drive.h"
#include "control/transform.h"
#include "hal/adc.h"
#include "hal/angle.h"
#include "hal/irq.h"
#include "hal/pwm.h"

#define DUTY_MIDDLE 16384
#define OVERRUNS_TO_FAULT 3
#define PERIODS_TO_ACT 3

/* What the period's own decisions need besides the sample that goes to the identification. */
typedef struct {
    ab_t i;
    fx_pair_t i_dq, advanced;
    int32_t sum_q27;
    angle_t angle;
} instant_t;

static instant_t observe(drive_t *drive, sample_t *sample)
{
    hal_adc_read(&sample->counts);
    const measure_t measured = measure_step(&drive->motor.measure, &sample->counts);
    instant_t now;
    now.i = measured.i;
    const uint32_t read = hal_angle_read();
    sample->theta_m = read + (uint32_t)drive->task.angle_correction[read >> ANGLE_HARMONICS_SHIFT];
    now.angle = angle_tracker_step(&drive->motor.angle_tracker, &drive->fast.angle_tracker, sample->theta_m);
    now.sum_q27 = measured.sum_q27;
    const dq_t i = park(measured.i, fx_rotation(now.angle.theta_e));
    now.i_dq = fx_arch_pkhbt(i.d, i.q);
    /* The middle of the period in which the duties will act: 1.5 periods ahead. */
    now.advanced = fx_rotation(now.angle.theta_e + (uint32_t)now.angle.step + (uint32_t)(now.angle.step >> 1));
    sample->mrai.i = i;
    sample->mrai.omega = now.angle.omega_q31;
    sample->theta_e = now.angle.theta_e;
    sample->v_dc = measured.v_dc;
    return now;
}

/* Counts the periods that find the identification still busy. */
static void watch(drive_t *drive, uint32_t unfinished)
{
    fast_state_t *fast = &drive->fast;
    if (__builtin_expect(unfinished == 0U, 1)) {
        fast->overruns_in_a_row = 0;
        return;
    }
    fast->overruns++;
    fast->overruns_in_a_row++;
    if (fast->overruns_in_a_row >= OVERRUNS_TO_FAULT) {
        fast->overruns_in_a_row = OVERRUNS_TO_FAULT;
        drive_raise_fault(drive, FAULT_OVERRUN);
    }
}

/* Hands this period to the identification. One that is two periods late still reads the slot whose turn it is:
 * that period is lost. */
static void publish(drive_t *drive, sample_t *sample)
{
    fast_state_t *fast = &drive->fast;
    if (sample != &fast->lost) {
        sample_box_publish(&drive->samples);
    }
    fast->pended++;
    hal_irq_pend_mrai();
}

/* The safe state: low sides closed, or all gates open. */
static __attribute__((noinline, cold)) void bridge_off(drive_t *drive, sample_t *sample, safe_t safe)
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
    drive->fast.coming = (dq_t){0, 0};
    drive->fast.periods_on = 0;
}

/* Circle or hexagon: the voltage to come may not be the one wanted. */
static void note_limits(drive_t *drive, sample_t *sample, const modulate_in_t *modulation,
                        const current_control_out_t *wanted, const modulate_out_t *made)
{
    sample->voltage_limited = wanted->limited || made->limited;
    if (made->limited) {
        const modulate_in_t again = *modulation; /* a copy: the usual case keeps its values in registers */
        sample->snapped = true;
        drive->fast.coming = modulate_acted(&drive->motor.modulate, &again, made->duty);
    }
}

static void bridge_on(drive_t *drive, sample_t *sample, const instant_t *now, const current_target_t *target)
{
    fast_state_t *fast = &drive->fast;
    const motor_t *m = &drive->motor;
    const current_control_in_t control = {
        .target = target,
        .flux = &sample->mrai.flux,
        .omega = now->angle.omega_q31,
        .psi_delta = drive->slow.psi_delta_q15,
        .v_dc = sample->v_dc,
    };
    const current_control_out_t wanted = current_control_step(&m->current_control, &fast->current_control, &control);
    const modulate_in_t modulation = {wanted.u, now->i_dq, now->advanced, sample->v_dc, wanted.clear};
    const modulate_out_t made = modulate_step(&m->modulate, &modulation);
    hal_pwm_write(made.duty);
    hal_pwm_enable(true);
    sample->mrai.u.d = fast->coming.d; /* acts now: the duties before these */
    sample->mrai.u.q = fast->coming.q;
    sample->voltage_limited = false;
    sample->snapped = false;
    fast->coming.d = wanted.u.d;
    fast->coming.q = wanted.u.q;
    if (!wanted.clear) {
        note_limits(drive, sample, &modulation, &wanted, &made);
    }
    sample->acting = true;
    if (fast->periods_on < PERIODS_TO_ACT) {
        fast->periods_on++;
        sample->acting = fast->periods_on >= PERIODS_TO_ACT;
    }
}

/* A reset comes before this period's monitors: what is still wrong is latched again at once.
 * Bad motor data stay bad. */
static void forget_faults(drive_t *drive, uint32_t asked)
{
    if (drive->fast.fault_resets != asked) {
        drive->fast.fault_resets = asked;
        drive->fast.faults = drive->fast.faults & FAULT_CONFIG;
    }
}

/* Something is not as it should be, or was a moment ago. */
static __attribute__((noinline)) void look(drive_t *drive, const monitor_in_t *seen, bool run)
{
    const uint32_t faults = monitor_step(&drive->motor.monitor, &drive->fast.monitor, seen);
    /* An unpowered bridge may see no dc voltage; what opens the gates while they are closed is a fault at any time. */
    if (faults != 0) {
        drive_raise_fault(drive, run ? faults : faults & ~(uint32_t)FAULT_UNDER_VOLTAGE);
    }
}

/* Everything the period needs is compiled into the one interrupt, with a compiler that sees all files. */
__attribute__((flatten)) void fast_isr(drive_t *drive)
{
    const command_t *command = command_box_read(&drive->commands);
    forget_faults(drive, command->fault_resets);
    const uint32_t unfinished = drive->fast.pended - drive->slow.finished;
    watch(drive, unfinished);
    sample_t *sample = __builtin_expect(unfinished > 1U, 0) ? &drive->fast.lost : sample_box_begin(&drive->samples);
    const instant_t now = observe(drive, sample);
    const bool quiet = monitor_quiet(&drive->motor.monitor, &drive->fast.monitor, now.i_dq, now.sum_q27, sample->v_dc);
    if (__builtin_expect(now.angle.jumped || !quiet, 0)) {
        const monitor_in_t seen = {measure_phases(now.i, now.sum_q27), sample->v_dc, now.angle.jumped};
        look(drive, &seen, command->run);
    }
    sample->mrai.flux = flux_table_step(&drive->motor.flux_table, sample->mrai.i);
    if (command->run && drive->fast.faults == 0) {
        bridge_on(drive, sample, &now, &command->target);
    } else {
        if (command->faults != 0U) {
            drive_raise_fault(drive, command->faults);
        }
        bridge_off(drive, sample, command->safe);
    }
    publish(drive, sample);
}
