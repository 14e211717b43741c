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

typedef struct {
    measure_t measured;
    angle_t angle;
    fx_sincos_t at;       /* now: the frame of the samples */
    fx_sincos_t advanced; /* the middle of the period in which the duties will act: 1.5 periods ahead */
    dq_t i;
    flux_point_t flux;
} instant_t;

static instant_t observe(drive_t *drive)
{
    adc_counts_t counts;
    instant_t now;
    hal_adc_read(&counts);
    now.measured = measure_step(&drive->motor.measure, &counts);
    now.angle = angle_tracker_step(&drive->motor.angle_tracker, &drive->fast.angle_tracker, hal_angle_read());
    const uint32_t ahead = now.angle.theta_e + (uint32_t)now.angle.step + (uint32_t)(now.angle.step >> 1);
    now.at = fx_sincos((uint16_t)((now.angle.theta_e + 0x8000U) >> 16));
    now.advanced = fx_sincos((uint16_t)((ahead + 0x8000U) >> 16));
    now.i = park(clarke(now.measured.i), now.at);
    now.flux = flux_table_step(&drive->motor.flux_table, now.i);
    return now;
}

/* Hands this period to the identification, and notices when it has not finished the last one. */
static void publish(drive_t *drive, const instant_t *now)
{
    fast_state_t *fast = &drive->fast;
    if (drive->slow.finished != fast->pended) {
        fast->overruns++;
        fast->overruns_in_a_row++;
        if (fast->overruns_in_a_row >= OVERRUNS_TO_FAULT) {
            fast->overruns_in_a_row = OVERRUNS_TO_FAULT;
            drive_raise_fault(drive, FAULT_OVERRUN);
        }
    } else {
        fast->overruns_in_a_row = 0;
    }
    *sample_box_begin(&drive->samples) = (sample_t){
        .mrai = {.i = now->i, .u = fast->acting, .flux = now->flux, .omega = now->angle.omega_q31},
        .v_dc = now->measured.v_dc,
        .acting = fast->periods_on >= PERIODS_TO_ACT,
        .voltage_limited = fast->current_control.limited || fast->modulated.limited,
    };
    sample_box_publish(&drive->samples);
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

static void bridge_on(drive_t *drive, const instant_t *now, const current_target_t *target)
{
    fast_state_t *fast = &drive->fast;
    const motor_t *m = &drive->motor;
    const current_control_in_t control = {
        .target = target,
        .flux = &now->flux,
        .omega = fx_q15_from_q31(now->angle.omega_q31),
        .psi_delta = drive->slow.psi_delta_q15,
        .v_dc = now->measured.v_dc,
    };
    fast->acting = fast->modulated.acted;
    const dq_t u = current_control_step(&m->current_control, &fast->current_control, &control);
    const modulate_in_t modulation = {.u = u, .i = now->i, .advanced = now->advanced, .v_dc = now->measured.v_dc};
    fast->modulated = modulate_step(&m->modulate, &modulation);
    hal_pwm_write(fast->modulated.duty);
    hal_pwm_enable(true);
    fast->periods_on = (uint8_t)fx_min_s32(fast->periods_on + 1, PERIODS_TO_ACT);
}

void fast_isr(drive_t *drive)
{
    const instant_t now = observe(drive);
    const command_t command = command_box_read(&drive->commands);
    const monitor_in_t seen = {now.measured.i, now.measured.v_dc, now.angle.jumped};

    const uint32_t faults = monitor_step(&drive->motor.monitor, &drive->fast.monitor, &seen);
    /* An unpowered bridge may see no dc voltage; what opens the gates while they are closed is a fault at any time. */
    drive_raise_fault(drive, command.run ? faults : faults & ~(uint32_t)FAULT_UNDER_VOLTAGE);
    if (command.run && drive->fast.faults == 0) {
        bridge_on(drive, &now, &command.target);
    } else {
        bridge_off(drive);
    }
    publish(drive, &now);
}
