/* SPDX-License-Identifier: Apache-2.0 */
/* One drive on a hardware interface made of variables, and its stages as functions of their own.
 * The stages work on a copy of the drive: they see the state that the interrupt will see, and
 * leave none behind. Compiled for the target and, for comparison, for this computer. */
#include "app/drive.h"
#include "control/transform.h"
#include "hal/adc.h"
#include "hal/angle.h"
#include "hal/irq.h"
#include "hal/pwm.h"
#include "hal/temperature.h"

/* Called by name only; a stage is compiled as one piece, as it is in the interrupt. */
#define CALLED __attribute__((used, externally_visible, noinline))
#define STAGE __attribute__((used, externally_visible, noinline, flatten))

enum { OUTPUTS = 24 };

void drive_start(uint32_t mode);
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
void bench_current_tick(void);
void bench_subset(void);

static struct {
    adc_counts_t counts;
    uint32_t theta_m;
    duty_t duty;
    bool gates;
    bool limited;
} port;
static drive_t drive;
static drive_t copy;
static flux_point_t flux;
/* What the exchange has found for the stages: it is counted with the interrupts. */
static struct {
    dq_t i;
    const mrai_in_t *sample;
    const mrai_schedule_t *schedule;
    const current_target_t *target;
} found;
static int32_t outputs[OUTPUTS];
/* A tick of the leanest peer's content: see bench_subset(). */
typedef struct {
    int32_t kp_q24, ki_q15, target_d, target_q;
    int32_t s_d_q30, s_q_q30;
    int32_t i_a, i_b;
} subset_t;
static subset_t subset = {.kp_q24 = 1 << 23, .ki_q15 = 800, .target_d = -1000, .target_q = 4000};

void hal_adc_read(adc_counts_t *counts)
{
    *counts = port.counts;
}

uint32_t hal_angle_read(void)
{
    return port.theta_m;
}

void hal_pwm_write(duty_t duty)
{
    port.duty = duty;
}

void hal_pwm_enable(bool on)
{
    port.gates = on;
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

CALLED void drive_start(uint32_t mode)
{
    drive_init(&drive, &motor);
    drive.request.identification_mode = (mode == 0U) ? IDENTIFICATION_PAPER : IDENTIFICATION_ROBUST;
}

CALLED void drive_request(int32_t torque, uint32_t enable)
{
    drive.request.torque = (q15_t)torque;
    drive.request.enable = enable != 0U;
}

CALLED void drive_sample(uint32_t i_ab, uint32_t i_c_v_dc, uint32_t theta_m)
{
    subset.i_a = ((int32_t)(i_ab & 0xFFFFU) - 2048) * 16;
    subset.i_b = ((int32_t)(i_ab >> 16) - 2048) * 16;
    port.counts =
        (adc_counts_t){(uint16_t)i_ab, (uint16_t)(i_ab >> 16), (uint16_t)i_c_v_dc, (uint16_t)(i_c_v_dc >> 16)};
    port.theta_m = theta_m;
}

CALLED void drive_copy(void)
{
    copy = drive;
    found.sample = &sample_box_look(&copy.samples)->mrai;
    found.schedule = schedule_box_read(&copy.schedules);
    found.target = &command_box_read(&copy.commands)->target;
    found.i = found.sample->i;
}

CALLED uint32_t drive_limited(void)
{
    return sample_box_look(&drive.samples)->voltage_limited ? 1U : 0U;
}

/* Duties and gates first, then everything that lives on from one period to the next. */
CALLED const int32_t *drive_outputs(void)
{
    const fast_state_t *fast = &drive.fast;
    const mrai_state_t *mrai = &drive.slow.mrai;
    const sample_t *sample = sample_box_look(&drive.samples);
    const int32_t all[OUTPUTS] = {
        port.duty.a, port.duty.b, port.duty.c, port.gates,
        sample->mrai.i.d, sample->mrai.i.q, sample->mrai.flux.psi_d, sample->mrai.flux.psi_q, sample->mrai.omega,
        fast->coming.d, fast->coming.q, fast->current_control.s_d_q30, fast->current_control.s_q_q30,
        (int32_t)fast->faults, mrai->e_d_q27, mrai->e_q_q27, mrai->psi_delta, mrai->r_delta,
        drive.slow.torque.sum, drive.slow.torque.mean,
        drive.task.torque_estimate, drive.task.learnt.psi_delta, drive.task.identify.filter.p[0][0],
        drive.task.identify.local.q,
    };
    for (int k = 0; k < OUTPUTS; k++) {
        outputs[k] = all[k];
    }
    return outputs;
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
    flux = flux_table_step(&d->motor.flux_table, found.i);
}

STAGE void bench_mrai(void)
{
    drive_t *d = the_copy();
    mrai_step(&d->motor.mrai, found.schedule, &d->slow.mrai, found.sample);
}

STAGE void bench_torque_estimate(void)
{
    drive_t *d = the_copy();
    const mrai_in_t *in = found.sample;
    (void)torque_estimate_step(&d->slow.torque, in->i, &in->flux, d->slow.mrai.psi_delta);
}

/* From converter counts and angle to duties; what the tables answer was found before. */
STAGE void bench_current_tick(void)
{
    drive_t *d = the_copy();
    const motor_t *m = &d->motor;
    const measure_t measured = measure_step(&m->measure, &port.counts);
    const angle_t angle = angle_tracker_step(&m->angle_tracker, &d->fast.angle_tracker, port.theta_m);
    const dq_t i = park(measured.i, fx_rotation(angle.theta_e));
    const fx_pair_t i_dq = fx_arch_pkhbt(i.d, i.q);
    const fx_pair_t advanced = fx_rotation(angle.theta_e + (uint32_t)angle.step + (uint32_t)(angle.step >> 1));
    const current_control_in_t control = {
        .target = found.target,
        .flux = &flux,
        .omega = angle.omega_q31,
        .psi_delta = d->slow.psi_delta_q15,
        .v_dc = measured.v_dc,
    };
    const current_control_out_t wanted =
        current_control_step(&m->current_control, &d->fast.current_control, &control);
    const modulate_in_t modulation = {wanted.u, i_dq, advanced, measured.v_dc, wanted.clear};
    const modulate_out_t made = modulate_step(&m->modulate, &modulation);
    port.duty = made.duty;
    port.limited = wanted.limited || made.limited;
}

/* What the leanest peer's tick runs, from currents in two phases and an angle to duties: sine and cosine, Clarke, Park,
 * two PI with limited integrators and output, inverse Park, SVPWM. No scaling of counts, no tables, no decoupling, no
 * circle, no dc voltage, no dead time. Voltages are in units of v_dc. */
static inline int32_t pi(int32_t kp_q24, int32_t ki_q15, int32_t error, int32_t *s_q30)
{
    const int32_t u_q22 = fx_mulhi_add(64, kp_q24, error * 32768) + (*s_q30 >> 8);
    *s_q30 = fx_sat_bits(*s_q30 + ki_q15 * error, 30);
    return fx_sat_bits(u_q22 >> 7, 15); /* 1/2: inside the hexagon */
}

/* As modulate.c does it, without dead time. */
static inline duty_t svpwm(int32_t alpha, int32_t beta)
{
    const int32_t side = fx_arch_opaque(beta * Q16(0.86602540378443865));
    const int32_t a = alpha * 65536;
    const int32_t b = side - alpha * 32768;
    const int32_t c = b - 2 * side;
    const int32_t hi = fx_max_s32(a, fx_max_s32(b, c));
    const int32_t lo = fx_min_s32(a, fx_min_s32(b, c));
    const uint32_t shift = 0x40008000U - (uint32_t)((hi >> 1) + (lo >> 1));
    return (duty_t){((uint32_t)a + shift) >> 16, ((uint32_t)b + shift) >> 16, ((uint32_t)c + shift) >> 16};
}

STAGE void bench_subset(void)
{
    subset_t *c = &subset;
    __asm__("" : "+r"(c));
    const int32_t beta = ((c->i_a + 2 * c->i_b) * Q15(0.57735026918962576) + 0x4000) >> 15;
    const fx_pair_t at = fx_rotation(port.theta_m);
    const dq_t i = park((ab_t){c->i_a, beta}, at);
    const int32_t u_d = pi(c->kp_q24, c->ki_q15, c->target_d - i.d, &c->s_d_q30);
    const int32_t u_q = pi(c->kp_q24, c->ki_q15, c->target_q - i.q, &c->s_q_q30);
    const ab_t v = inverse_park_q30((dq_t){u_d, u_q}, at);
    port.duty = svpwm(v.alpha >> 15, v.beta >> 15);
}
