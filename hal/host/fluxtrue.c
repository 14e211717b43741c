/* SPDX-License-Identifier: Apache-2.0 */
#include "hal/host/fluxtrue.h"

#include <float.h>
#include <math.h>
#include <stdlib.h>

#include "hal/host/can_host.h"
#include "hal/host/instance.h"
#include "hal/host/port.h"
#include "types/version.h"

#define TURN_RAD 6.283185307179586
#define DUTY_ONE 32768.0

/* A value beyond these limits is not a measurement of a traction drive but an error, for example of units. */
#define CURRENT_CREDIBLE_A 1e5
#define VOLTAGE_CREDIBLE_V 1e5
#define VOLTAGE_NEGATIVE_SHARE 0.05 /* of full scale: an offset of the sensor, not a reversed dc link */
#define ANGLE_CREDIBLE_RAD 1e9
#define TEMPERATURE_MIN_C (-100.0)
#define TEMPERATURE_MAX_C 500.0
#define AMBIENT_C 20.0

void fluxtrue_init_with(fluxtrue_t *instance, const motor_t *data)
{
    *instance =
        (fluxtrue_t){.data = data, .winding_C = AMBIENT_C, .board = {.inverter_C = AMBIENT_C, .known_share = 1.0}};
    external_watchdog_start(&instance->board.external_watchdog);
    nvm_host_erase(&instance->nvm);
    instance->motor = *data;
    drive_init(&instance->drive, &instance->motor);
}

void fluxtrue_init(fluxtrue_t *instance)
{
    fluxtrue_init_with(instance, &motor);
}

const char *fluxtrue_version(void)
{
    return firmware_version.text;
}

int fluxtrue_abi(void)
{
    return FLUXTRUE_ABI;
}

const char *fluxtrue_motor(void)
{
    return motor.name;
}

/* The motor data hold it as a float: of a whole number of Hz the exact period is given. */
double fluxtrue_period_s(void)
{
    const double pwm_hz = 1.0 / (double)motor.bases.period_s;
    const double whole = round(pwm_hz);
    return 1.0 / ((fabs(pwm_hz - whole) <= pwm_hz * FLT_EPSILON) ? whole : pwm_hz);
}

fluxtrue_t *fluxtrue_create(void)
{
    fluxtrue_t *instance = malloc(sizeof *instance);
    if (instance) {
        fluxtrue_init(instance);
    }
    return instance;
}

void fluxtrue_destroy(fluxtrue_t *drive)
{
    free(drive);
}

void fluxtrue_reset(fluxtrue_t *drive)
{
    const bool on_bus = drive->on_bus;
    fluxtrue_init_with(drive, drive->data);
    if (on_bus) {
        can_host_attach(drive);
    }
}

/* Written so that a NaN fails: every comparison with it is false. */
static bool credible(const motor_t *m, const double in[6])
{
    const double v_min_V = -VOLTAGE_NEGATIVE_SHARE * (double)m->v_dc_full_scale_V;
    for (int k = 0; k < 3; k++) {
        if (!(fabs(in[k]) <= CURRENT_CREDIBLE_A)) {
            return false;
        }
    }
    return in[3] >= v_min_V && in[3] <= VOLTAGE_CREDIBLE_V && fabs(in[4]) <= ANGLE_CREDIBLE_RAD &&
           in[5] >= TEMPERATURE_MIN_C && in[5] <= TEMPERATURE_MAX_C;
}

static uint16_t to_count(double share, unsigned bits)
{
    const double top = (double)(1U << bits) - 1.0;
    return (uint16_t)fmin(fmax(floor(share * (top + 1.0) + 0.5), 0.0), top);
}

/* The tracker begins anew with another source of the angle. */
static void take_angle(fluxtrue_t *d, double turns)
{
    const double period_s = (double)d->motor.bases.period_s;
    const angle_source_in_t in = {(double)d->drive.motor->angle_tracker.pole_pairs, period_s, d->gates};
    bool changed;
    d->theta_m = angle_source_step(&d->angle_source, &in, turns, &changed);
    if (changed) {
        d->drive.fast.angle_tracker.samples = 0;
    }
    if (!spin_limit_step(&d->spin_limit, d->angle_source.turns, period_s)) {
        d->drive.request.enable = false;
    }
}

static void take_samples(fluxtrue_t *d, const double in[6])
{
    const motor_t *m = d->drive.motor;
    const double span_A = 2.0 * (double)m->current_full_scale_A;
    const double turns = in[4] / TURN_RAD;
    d->counts = (adc_counts_t){
        .i_a = to_count(in[0] / span_A + 0.5, m->adc_bits),
        .i_b = to_count(in[1] / span_A + 0.5, m->adc_bits),
        .i_c = to_count(in[2] / span_A + 0.5, m->adc_bits),
        .v_dc = to_count(in[3] / (double)m->v_dc_full_scale_V, m->adc_bits),
    };
    take_angle(d, turns);
    d->winding_C = in[5];
}

static void run_period(fluxtrue_t *d)
{
    host_port_select(d);
    if (host_port_fault_line(d)) {
        drive_raise_fault(&d->drive, FAULT_GATE);
    }
    fast_isr(&d->drive);
    if (d->mrai_pending) {
        d->mrai_pending = false;
        mrai_isr(&d->drive);
    }
    d->periods++;
    external_watchdog_pass(&d->board.external_watchdog, 1e6 * (double)d->motor.bases.period_s);
    if (d->periods % d->motor.bases.periods_per_step == 0U && !d->board.task_stuck) {
        if (d->on_bus) {
            ecu_task_1khz(&d->ecu);
        } else {
            task_1khz(&d->drive);
        }
        (void)memory_background(&d->memory, &d->drive);
    }
    host_port_select(NULL);
}

void fluxtrue_step(fluxtrue_t *drive, const double in[6], double out[4])
{
    if (credible(drive->drive.motor, in)) {
        take_samples(drive, in);
    } else {
        /* The last credible samples are used again, so that filters and observers continue; the fault brings the safe
         * state. */
        drive_raise_fault(&drive->drive, FAULT_INPUT);
    }
    run_period(drive);
    out[0] = drive->duty.a / DUTY_ONE;
    out[1] = drive->duty.b / DUTY_ONE;
    out[2] = drive->duty.c / DUTY_ONE;
    out[3] = drive->gates && !drive->board.fault_latched ? 1.0 : 0.0;
}
