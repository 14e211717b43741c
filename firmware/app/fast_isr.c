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
    fx_pair_t i_dq, advanced;
    int32_t zero_q28, v_dc;
    q31_t omega;
} instant_t;

/* What the angle sensor is known to be wrong by, where it stands. */
static uint32_t correction(const drive_t *drive, uint32_t theta_m)
{
    const volatile int32_t *parts = drive->task.angle_correction;
    __asm__("" : "+r"(parts)); /* the address once: not part of every index */
    return (uint32_t)parts[theta_m >> ANGLE_HARMONICS_SHIFT];
}

static instant_t observe(drive_t *drive, sample_t *sample)
{
    adc_counts_t counts;
    hal_adc_read(&counts);
    const measure_t measured = measure_step(&drive->motor.measure, &counts);
    sample->i_ab = fx_arch_pkhbt(measured.i.alpha, measured.i.beta);
    sample->zero_q28 = measured.zero_q28;
    sample->v_dc = measured.v_dc;
    const uint32_t read = hal_angle_read();
    const uint32_t theta_m = read + correction(drive, read);
    sample->theta_m = theta_m;
    const angle_t angle = angle_tracker_step(&drive->motor.angle_tracker, &drive->fast.angle_tracker, theta_m);
    if (__builtin_expect(angle.jumped, 0)) {
        monitor_note_jump(&drive->fast.monitor);
    }
    sample->theta_e = angle.theta_e;
    sample->mrai.omega = angle.omega_q31;
    const dq_t i = park(measured.i, fx_rotation(angle.theta_e));
    sample->mrai.i = i;
    return (instant_t){
        .i_dq = fx_arch_pkhbt(i.d, i.q),
        /* The middle of the period in which the duties will act: 1.5 periods ahead. */
        .advanced = fx_rotation(angle.theta_e + (uint32_t)angle.step + (uint32_t)(angle.step >> 1)),
        .zero_q28 = measured.zero_q28,
        .v_dc = measured.v_dc,
        .omega = angle.omega_q31,
    };
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

/* Hands this period to the identification: the robust one's sums are made here, the paper's law runs below. */
static void publish(drive_t *drive, const sample_t *sample, uint32_t next)
{
    fast_state_t *fast = &drive->fast;
    sample_box_publish(&drive->samples, next);
    if (__builtin_expect(drive->request.identification_mode != IDENTIFICATION_ROBUST, 0)) {
        identify_window_spoil(&fast->window); /* it would have a gap */
        hal_irq_pend_mrai();
        return;
    }
    drive->slow.psi_delta_q15 = drive->task.identified.psi_delta;
    drive->slow.finished = next;
    const identify_sample_t in = {
        .i = sample->mrai.i,
        .u = sample->mrai.u,
        .flux = &sample->mrai.flux,
        .theta = sample->theta_e,
    };
    if (__builtin_expect(identify_window_step(&fast->window, &in), 0)) {
        window_box_write(&drive->windows, &fast->window);
        identify_window_restart(&fast->window);
    }
}

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
    sample->voltage_limited = true;
    if (made.limited != 0U) {
        sample->snapped = true;
        identify_window_snapped(&drive->fast.window);
    }
    drive->fast.coming = modulate_acted(&drive->motor.modulate, made.duty, i, advanced, sample->v_dc);
}

/* The duties of the first period act in the second; the third sample ends a period of which they are known. */
static __attribute__((noinline, cold)) void starting(fast_state_t *fast, sample_t *sample)
{
    fast->periods_on++;
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
            bridge_limited(drive, sample, made, now->i_dq, now->advanced);
        }
    }
    hal_pwm_write(duty);
    hal_pwm_enable(true);
    if (__builtin_expect(fast->periods_on < PERIODS_TO_ACT, 0)) {
        starting(fast, sample);
    }
}

/* A reset comes before this period's monitors: what is still wrong is latched again at once. It never comes with the
 * command to run. Bad motor data stay bad. */
static __attribute__((noinline, cold)) void forget_faults(drive_t *drive, uint32_t asked)
{
    if (drive->fast.fault_resets != asked) {
        drive->fast.fault_resets = asked;
        drive->fast.faults = drive->fast.faults & FAULT_CONFIG;
    }
}

static __attribute__((noinline, cold)) void rest(drive_t *drive, sample_t *sample, const command_t *command)
{
    if (command->faults != 0U) {
        drive_raise_fault(drive, command->faults);
    }
    bridge_off(drive, sample, command->safe);
}

/* Something is not as it should be, or was a moment ago: seldom, so the phases are found from the vector again. */
static __attribute__((noinline, cold)) void look(drive_t *drive, const sample_t *sample, bool run)
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

/* Everything the period needs is compiled into the one interrupt, with a compiler that sees all files. */
__attribute__((flatten)) void fast_isr(drive_t *drive)
{
    const command_t *command = command_box_read(&drive->commands);
    if (__builtin_expect(!command->run, 0)) {
        forget_faults(drive, command->fault_resets);
    }
    const uint32_t published = drive->samples.generation;
    const uint32_t unfinished = published - drive->slow.finished;
    watch(drive, unfinished);
    uint32_t next = published + 1U;
    sample_t *sample = sample_box_begin(&drive->samples, next);
    if (__builtin_expect(unfinished > 1U, 0)) {
        sample = &drive->fast.lost; /* the identification still reads the slot whose turn it is */
        next--;
    }
    const instant_t now = observe(drive, sample);
    const bool quiet = monitor_quiet(&drive->motor.monitor, &drive->fast.monitor, now.i_dq, now.zero_q28, now.v_dc);
    if (__builtin_expect(!quiet, 0)) {
        look(drive, sample, command->run);
    }
    sample->mrai.flux = flux_table_step(&drive->motor.flux_table, sample->mrai.i);
    if (command->run && drive->fast.faults == 0) {
        bridge_on(drive, sample, &now, &command->target);
    } else {
        rest(drive, sample, command);
    }
    publish(drive, sample, next);
}
