/* SPDX-License-Identifier: Apache-2.0 */
/* One drive on a hardware interface made of variables, and its stages as functions of their own.
 * The stages work on a copy of the drive: they see the state that the interrupt will see, and
 * leave none behind. Compiled for the target and, for comparison, for this computer. */
#include "control/current/transform.h"
#include "drive/mrai/mrai_seam.h"
#include "drive/mrai/schedule_box.h"
#include "hal/adc.h"
#include "hal/angle.h"
#include "hal/irq.h"
#include "hal/pwm.h"
#include "hal/temperature.h"

/* Called by name only; a stage is compiled as one piece, as it is in the interrupt. */
#define CALLED __attribute__((used, externally_visible, noinline))
#define STAGE __attribute__((used, externally_visible, noinline, flatten))

enum { OUTPUTS = 24, CORE_V_DC = 21845 };

void drive_start(uint32_t mode);
void drive_start_for(uint32_t mode, const motor_t *data);
void drive_request(int32_t torque, uint32_t enable);
void drive_sample(uint32_t i_ab, uint32_t i_c_v_dc, uint32_t theta_m);
void drive_copy(void);
uint32_t drive_limited(void);
const int32_t *drive_outputs(void);
void bench_nothing(void);
void bench_fast_isr(void);
void bench_mrai_isr(void);
void bench_task(void);
void bench_flux_table(void);
void bench_mrai(void);
void bench_torque_estimate(void);
void bench_current_tick_tables(void);
void bench_current_tick(void);
void bench_current_core(void);
void bench_measure(void);
void bench_angle_tracker(void);
void bench_current_control(void);
void bench_modulate(void);
void bench_torque_path(void);
void bench_window(void);
const drive_t *drive_now(void);

static struct {
    adc_counts_t counts;
    uint32_t theta_m;
    duty_t duty;
    bool gates;
    uint32_t limited;
} port;
static drive_t drive;
static drive_t copy;
static flux_point_t flux;
/* What the exchange has found for the stages: it is counted with the interrupts. */
static struct {
    dq_q15_t i;
    const operating_point_t *sample;
    const mrai_schedule_t *schedule;
    const current_target_t *target;
    abc_q15_t phases;
    uint32_t theta_e;
    current_target_t core; /* where the currents are already, as the core's machine has an inductance of one */
    current_control_out_t wanted;
} found;
static int32_t outputs[OUTPUTS];

void hal_adc_read(adc_counts_t *counts)
{
    *counts = port.counts;
}

void hal_adc_latest(current_counts_t *counts)
{
    *counts = (current_counts_t){port.counts.i_a, port.counts.i_b, port.counts.i_c};
}

int16_t hal_adc_known_permille(void)
{
    return 1000;
}

uint32_t hal_angle_read(void)
{
    return port.theta_m;
}

bool hal_angle_is_absolute(void)
{
    return true;
}

void hal_pwm_write(duty_t duty)
{
    port.duty = duty;
}

void hal_pwm_enable(bool on)
{
    port.gates = on;
}

bool hal_pwm_gates(void)
{
    return port.gates;
}

void hal_irq_pend_mrai(void)
{
}

int16_t hal_temperature_winding_dC(void)
{
    return 200;
}

int16_t hal_temperature_inverter_dC(void)
{
    return 200;
}

/* With other motor data, which lie in memory. */
CALLED void drive_start_for(uint32_t mode, const motor_t *data)
{
    drive_init(&drive, data);
    drive.request.identification_mode = (mode == 0U) ? IDENTIFICATION_PAPER : IDENTIFICATION_ROBUST;
}

CALLED void drive_start(uint32_t mode)
{
    drive_start_for(mode, &motor);
}

CALLED void drive_request(int32_t torque, uint32_t enable)
{
    drive.request.torque_arbitrated = (q15_t)torque;
    drive.request.enable = enable != 0U;
}

CALLED void drive_sample(uint32_t i_ab, uint32_t i_c_v_dc, uint32_t theta_m)
{
    port.counts = (adc_counts_t){i_ab & 0xFFFFU, i_ab >> 16, i_c_v_dc & 0xFFFFU, i_c_v_dc >> 16};
    port.theta_m = theta_m;
}

CALLED void drive_copy(void)
{
    copy = drive;
    found.sample = &sample_box_at(&copy.samples, copy.samples.generation)->point;
    found.schedule = schedule_box_read(&copy.mrai.schedules);
    found.target = &command_box_read(&copy.commands)->target;
    found.i = found.sample->i;
    found.phases = (abc_q15_t){((int32_t)port.counts.i_a - 2048) * 16, ((int32_t)port.counts.i_b - 2048) * 16,
                               ((int32_t)port.counts.i_c - 2048) * 16};
    found.theta_e = sample_box_at(&copy.samples, copy.samples.generation)->theta_e;
    found.core = (current_target_t){.psi = {(q15_t)found.i.d, (q15_t)found.i.q},
                                    .weighted = {found.i.d * 32768, found.i.q * 32768}};
}

CALLED uint32_t drive_limited(void)
{
    return sample_box_at(&drive.samples, drive.samples.generation)->voltage_limited ? 1U : 0U;
}

/* Duties and gates first, then everything that lives on from one period to the next. */
CALLED const int32_t *drive_outputs(void)
{
    const fast_state_t *fast = &drive.fast;
    const mrai_state_t *mrai = &drive.mrai.isr.law;
    const sample_t *sample = sample_box_at(&drive.samples, drive.samples.generation);
    const int32_t all[OUTPUTS] = {
        port.duty.a,
        port.duty.b,
        port.duty.c,
        port.gates,
        sample->point.i.d,
        sample->point.i.q,
        sample->point.flux.psi_d,
        sample->point.flux.psi_q,
        sample->point.omega,
        fast->u_next.d,
        fast->u_next.q,
        fast->current_control.s_d_q30,
        fast->current_control.s_q_q30,
        (int32_t)fast->faults,
        mrai->e_d_q27,
        mrai->e_q_q27,
        mrai->psi_delta,
        mrai->r_delta,
        drive.mrai.isr.torque.sum_q24,
        drive.mrai.task.torque_mean.mean,
        drive.task.identification.torque_estimated,
        drive.task.identification.psi_delta,
        drive.task.identify.kalman.p_q30[0],
        drive.task.identify.kept.local.q,
    };
    for (int k = 0; k < OUTPUTS; k++) {
        outputs[k] = all[k];
    }
    return outputs;
}

/* For task_kernels.c, which copies it. */
CALLED const drive_t *drive_now(void)
{
    return &drive;
}

CALLED void bench_nothing(void)
{
    __asm__ volatile("");
}

CALLED void bench_fast_isr(void)
{
    fast_isr(&drive);
}

CALLED void bench_mrai_isr(void)
{
    mrai_isr(&drive);
}

CALLED void bench_task(void)
{
    task_1khz(&drive);
}

/* The drive by its address, as the interrupts have it: else the compiler reaches everything from one symbol. */
static inline drive_t *the_copy(void)
{
    drive_t *address = &copy;
    __asm__("" : "+r"(address));
    return address;
}

/* From the measured currents to every table output, in memory. */
STAGE void bench_flux_table(void)
{
    const drive_t *d = the_copy();
    flux = flux_table_step(&d->period.flux_table, found.i);
}

STAGE void bench_mrai(void)
{
    drive_t *d = the_copy();
    mrai_step(&d->mrai_parameters, found.schedule, &d->mrai.isr.law, found.sample);
}

STAGE void bench_torque_estimate(void)
{
    drive_t *d = the_copy();
    const operating_point_t *in = found.sample;
    torque_estimate_add(&d->mrai.isr.torque, &in->i, &in->flux, mrai_psi_delta_q15(&d->mrai.isr.law));
}

static void modulate(const modulate_config_t *config, const current_control_out_t *wanted, fx_pair_t i,
                     fx_pair_t advanced)
{
    if (__builtin_expect(wanted->clear, 1)) {
        port.duty = modulate_clear(config, wanted->v, i, advanced);
    } else {
        const modulate_out_t made = modulate_step(config, wanted->v, i, advanced);
        port.duty = made.duty;
        port.limited = made.limited | wanted->limited;
    }
}

/* From converter counts and angle to duties. */
static inline __attribute__((always_inline)) void tick(drive_t *d, bool looks_up)
{
    const period_data_t *m = &d->period;
    const measure_t measured = measure_step(&m->measure, &port.counts);
    const angle_t angle = angle_tracker_follow(&m->angle_tracker, &d->fast.angle_tracker, port.theta_m);
    const dq_q15_t i = park(measured.i, fx_rotation(angle.theta_e));
    const fx_pair_t i_dq = fx_pair(i.d, i.q);
    const fx_pair_t advanced = fx_rotation(angle.theta_e + (uint32_t)angle.step + (uint32_t)(angle.step >> 1));
    flux_point_t here;
    if (looks_up) {
        here = flux_table_step(&m->flux_table, i);
    }
    const current_control_in_t control = {
        .target = found.target,
        .flux = looks_up ? &here : &flux,
        .v_dc = measured.v_dc,
    };
    const current_control_out_t wanted = current_control_step(&d->parameters.current_control, &d->fast.current_control,
                                                              &control);
    modulate(&d->parameters.modulate, &wanted, i_dq, advanced);
}

STAGE void bench_current_tick_tables(void)
{
    tick(the_copy(), true);
}

/* What the tables answer was found before. */
STAGE void bench_current_tick(void)
{
    tick(the_copy(), false);
}

/* As a step of its own, (CC-1): in the firmware it is part of measure_step(), which also scales the counts. */
static ab_q15_t clarke(abc_q15_t x)
{
    const int32_t alpha = x.a * Q15(2.0 / 3.0) + (x.b + x.c) * Q15(-1.0 / 3.0);
    const int32_t beta = (x.b - x.c) * Q15(0.57735026918962576);
    return (ab_q15_t){transform_round(alpha), transform_round(beta)};
}

/* What the leanest peer's tick has, of the same stages; all else is constant and so compiled away: inductance 1, no
 * feed-forward of speed, no dead time, a known dc voltage. */
STAGE void bench_current_core(void)
{
    static const modulate_config_t bare = {.alpha_q31 = Q31(0.6),
                                           .side_q31 = Q31(0.51961524227066314),
                                           .longest_q31 = 1 << 30,
                                           .nearer_rail_q31 = 1 << 30};
    drive_t *d = the_copy();
    const fx_pair_t at = fx_rotation(found.theta_e);
    const dq_q15_t i = park(clarke(found.phases), at);
    const flux_point_t as_flux = {.psi_d = (q15_t)i.d, .psi_q = (q15_t)i.q};
    const current_control_in_t control = {.target = &found.core, .flux = &as_flux, .v_dc = CORE_V_DC};
    const current_control_out_t wanted = current_control_step(&d->parameters.current_control, &d->fast.current_control,
                                                              &control);
    modulate(&bare, &wanted, 0, at);
}

STAGE void bench_measure(void)
{
    const drive_t *d = the_copy();
    const measure_t measured = measure_step(&d->period.measure, &port.counts);
    found.phases = (abc_q15_t){measured.i.alpha, measured.i.beta, measured.v_dc};
}

STAGE void bench_angle_tracker(void)
{
    drive_t *d = the_copy();
    found.theta_e = angle_tracker_follow(&d->period.angle_tracker, &d->fast.angle_tracker, port.theta_m).theta_e;
}

STAGE void bench_current_control(void)
{
    drive_t *d = the_copy();
    const current_control_in_t control = {
        .target = found.target,
        .flux = &flux,
        .v_dc = sample_box_at(&d->samples, d->samples.generation)->v_dc,
    };
    found.wanted = current_control_step(&d->parameters.current_control, &d->fast.current_control, &control);
}

/* The voltage of bench_current_control(). */
STAGE void bench_modulate(void)
{
    const drive_t *d = the_copy();
    modulate(&d->parameters.modulate, &found.wanted, fx_pair(found.i.d, found.i.q), fx_rotation(found.theta_e));
}

STAGE void bench_torque_path(void)
{
    drive_t *d = the_copy();
    const operating_point_t *in = found.sample;
    torque_estimate_add(&d->mrai.isr.torque, &in->i, &in->flux, mrai_psi_delta_q15(&d->mrai.isr.law));
    const torque_loop_in_t loop = {
        .torque_commanded = d->task.torque_commanded,
        .torque_estimated = torque_estimate_mean(&d->mrai.task.torque_mean, &d->mrai.isr.torque),
        .confidence = Q15_MAX,
        .enabled = true,
    };
    d->task.torque_corrected = torque_loop_step(&d->parameters.torque_loop, &d->task.torque_loop, &loop);
}

/* The fast ISR's share of the robust identification: one period summed, every tenth hands the sums over. */
STAGE void bench_window(void)
{
    drive_t *d = the_copy();
    const sample_t *sample = sample_box_at(&d->samples, d->samples.generation);
    const identify_sample_t in = {
        .i = sample->point.i,
        .u = sample->point.u,
        .flux = &sample->point.flux,
        .theta = sample->theta_e,
    };
    identify_window_add(&d->fast.window, &in);
    if (__builtin_expect(d->samples.generation + 1U == d->fast.step_end, 0)) {
        d->fast.step_end += d->motor->bases.periods_per_step;
        identify_window_end(&d->fast.window, &in);
        window_box_write(&d->windows, &d->fast.window);
        identify_window_restart(&d->fast.window);
    }
}
