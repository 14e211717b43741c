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
    abc_t i;
    angle_t angle;
    fx_sincos_t advanced; /* the middle of the period in which the duties will act: 1.5 periods ahead */
} instant_t;

static instant_t observe(drive_t *drive, sample_t *sample)
{
    adc_counts_t counts;
    hal_adc_read(&counts);
    const measure_t measured = measure_step(&drive->motor.measure, &counts);
    const angle_t angle = angle_tracker_step(&drive->motor.angle_tracker, &drive->fast.angle_tracker, hal_angle_read());
    const uint32_t ahead = angle.theta_e + (uint32_t)angle.step + (uint32_t)(angle.step >> 1);
    const fx_sincos_t at = fx_sincos((uint16_t)((angle.theta_e + 0x8000U) >> 16)); /* the frame of the samples */
    const dq_t i = park(clarke(measured.i), at);
    sample->mrai.i = i;
    sample->mrai.omega = angle.omega_q31;
    sample->v_dc = measured.v_dc;
    sample->mrai.flux = flux_table_step(&drive->motor.flux_table, i);
    return (instant_t){measured.i, angle, fx_sincos((uint16_t)((ahead + 0x8000U) >> 16))};
}

/* Counts the periods that find the identification still busy. */
static void watch(drive_t *drive, uint32_t unfinished)
{
    fast_state_t *fast = &drive->fast;
    if (unfinished == 0U) {
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
    sample->mrai.u = fast->acting;
    sample->acting = fast->periods_on >= PERIODS_TO_ACT;
    sample->voltage_limited = fast->current_control.limited || fast->modulated.limited;
    if (sample != &fast->lost) {
        sample_box_publish(&drive->samples);
    }
    fast->pended++;
    hal_irq_pend_mrai();
}

static void bridge_off(drive_t *drive)
{
    hal_pwm_enable(false);
    hal_pwm_write((duty_t){DUTY_MIDDLE, DUTY_MIDDLE, DUTY_MIDDLE});
    current_control_reset(&drive->fast.current_control);
    drive->fast.modulated = (modulate_out_t){.duty = {DUTY_MIDDLE, DUTY_MIDDLE, DUTY_MIDDLE}};
    drive->fast.acting = (dq_t){0, 0};
    drive->fast.periods_on = 0;
}

static void bridge_on(drive_t *drive, const sample_t *sample, const instant_t *now, const current_target_t *target)
{
    fast_state_t *fast = &drive->fast;
    const motor_t *m = &drive->motor;
    const current_control_in_t control = {
        .target = target,
        .flux = &sample->mrai.flux,
        .omega = fx_q15_from_q31(now->angle.omega_q31),
        .psi_delta = drive->slow.psi_delta_q15,
        .v_dc = sample->v_dc,
    };
    fast->acting = fast->modulated.acted;
    const dq_t u = current_control_step(&m->current_control, &fast->current_control, &control);
    const modulate_in_t modulation = {.u = u, .i = sample->mrai.i, .advanced = now->advanced, .v_dc = sample->v_dc};
    modulate_step(&m->modulate, &modulation, &fast->modulated);
    hal_pwm_write(fast->modulated.duty);
    hal_pwm_enable(true);
    fast->periods_on = (uint8_t)fx_min_s32(fast->periods_on + 1, PERIODS_TO_ACT);
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

/* Everything the period needs is compiled into the one interrupt, with a compiler that sees all files. */
__attribute__((flatten)) void fast_isr(drive_t *drive)
{
    const uint32_t unfinished = drive->fast.pended - drive->slow.finished;
    sample_t *sample = (unfinished > 1U) ? &drive->fast.lost : sample_box_begin(&drive->samples);
    const instant_t now = observe(drive, sample);
    const command_t *command = command_box_read(&drive->commands);
    forget_faults(drive, command->fault_resets);
    watch(drive, unfinished);
    const monitor_in_t seen = {now.i, sample->v_dc, now.angle.jumped};

    const uint32_t faults = monitor_step(&drive->motor.monitor, &drive->fast.monitor, &seen);
    /* An unpowered bridge may see no dc voltage; what opens the gates while they are closed is a fault at any time. */
    if (faults != 0) {
        drive_raise_fault(drive, command->run ? faults : faults & ~(uint32_t)FAULT_UNDER_VOLTAGE);
    }
    if (command->run && drive->fast.faults == 0) {
        bridge_on(drive, sample, &now, &command->target);
    } else {
        bridge_off(drive);
    }
    publish(drive, sample);
}
