/* SPDX-License-Identifier: Apache-2.0 */
#include <math.h>
#include <stdlib.h>

#include "twin/twin_private.h"

static twin_reference_t reference_start(const twin_t *twin)
{
    const double torque_max = twin->motor.torque_max_Nm;
    return (twin_reference_t){.torque_max = torque_max, .torque_limit = torque_max, .psi_plan = HUGE_VAL};
}

twin_t *twin_create(void)
{
    twin_t *twin = calloc(1, sizeof *twin);
    if (twin != NULL) {
        twin->motor = motor_si;
        twin->compensation = 1.0;
        twin->reference = reference_start(twin);
        twin->torque_loop = true;
        twin->identification = true;
        twin->schedule.voltage_scale = 1.0;
        twin->robust = true;
        twin_identify_reset(&twin->motor, &twin->identify);
    }
    return twin;
}

void twin_destroy(twin_t *twin)
{
    free(twin);
}

/* True when the condition has held in `samples` consecutive samples. */
static bool confirmed(int *count, bool now, int samples)
{
    *count = now ? *count + 1 : 0;
    return *count >= samples;
}

static unsigned faults(const motor_si_t *m, twin_monitor_t *state, twin_abc_t i, double v_dc)
{
    const double peak = fmax(fabs(i.a), fmax(fabs(i.b), fabs(i.c)));
    unsigned word = (peak > m->i_trip_A) ? TWIN_FAULT_OVER_CURRENT : 0U;
    if (confirmed(&state->over_voltage, v_dc > m->v_max_V, 2)) {
        word |= TWIN_FAULT_OVER_VOLTAGE;
    }
    if (confirmed(&state->under_voltage, v_dc < m->v_min_V, 10)) {
        word |= TWIN_FAULT_UNDER_VOLTAGE;
    }
    if (confirmed(&state->current_sum, fabs(i.a + i.b + i.c) > m->sum_max_A, 5)) {
        word |= TWIN_FAULT_CURRENT_SUM;
    }
    return word;
}

/* --- the 1 kHz task --------------------------------------------------------------------------- */

static void supervise(twin_t *twin)
{
    if (twin->fault_reset) {
        twin->fault_reset = false;
        twin->fault_word = twin->enable ? twin->fault_word : 0U;
    }
    if (twin->fault_word != 0U) {
        twin->run_state = TWIN_FAULT;
    } else {
        twin->run_state = twin->enable ? TWIN_RUN : TWIN_READY;
    }
}

static double slew(double from, double to, double step)
{
    return from + twin_clamp(to - from, -step, step);
}

static bool voltage_limited(const twin_t *twin)
{
    return twin->current.limited || twin->turning.limited || twin->modulation_limited;
}

/* The twin has no limits set by the vehicle and no inverter temperature: a cold inverter is assumed. */
static double limited_torque(twin_t *twin)
{
    const twin_limit_in_t in = {
        .torque_arbitrated = twin->torque_requested,
        .torque_drive = HUGE_VAL,
        .torque_regen = HUGE_VAL,
        .power_drive = HUGE_VAL,
        .power_regen = HUGE_VAL,
        .u = twin->sample.u,
        .i = twin->sample.i,
        .torque_estimated = twin->torque_estimated,
        .omega = twin->sample.omega,
        .v_dc = twin->v_dc,
        .reach = twin->reference.torque_max,
        .inverter_C = 20.0,
        .winding_C = twin->winding_C,
    };
    return twin_torque_limit(&twin->motor, &twin->limit, &in);
}

static double slew_now(const twin_t *twin)
{
    const motor_si_t *m = &twin->motor;
    const bool weak = twin->reference.psi_plan < m->psi_weak_Vs;
    const double slew_max = (m->torque_slew_Nm > 0.0) ? m->torque_slew_Nm : HUGE_VAL;
    return weak ? fmin(slew_max, m->torque_slew_weak_Nm) : slew_max;
}

/* Of the last step; the paper's identification takes no sums. */
static twin_dq_t mean_voltage(const twin_t *twin)
{
    const twin_window_t *w = &twin->complete;
    const double n = twin->motor.periods_per_step;
    return (twin->robust && w->acting) ? (twin_dq_t){w->sum_u.d / n, w->sum_u.q / n} : twin->sample.u;
}

static void torque_path(twin_t *twin)
{
    twin->torque_commanded = slew(twin->torque_commanded, limited_torque(twin), slew_now(twin));
    const twin_torque_in_t torque = {
        .torque_commanded = twin->torque_commanded,
        .torque_estimated = twin->torque_estimated,
        .confidence = twin->robust ? twin->identify.confidence : 1.0,
        .enabled = twin->torque_loop && !twin->current_mode,
        .limited = voltage_limited(twin) || twin->reference.limited,
    };
    const twin_reserve_in_t reserve = {
        .u = mean_voltage(twin),
        .psi = twin->psi_ref,
        .v_dc = twin->v_dc,
        .psi_plan = twin->reference.psi_plan,
        .psi_delta = twin->psi_delta,
        .acting = twin->periods_on >= 3 && !twin->current_mode,
    };
    const double shift = twin_voltage_reserve(&twin->motor, &twin->trim, &reserve);
    const double lq_error = twin->robust ? twin->identify.kalman.x[3] * twin->motor.identify_sigma[3] : 0.0;
    const twin_reference_in_t request = {
        .torque_corrected = twin_torque_loop(&twin->motor, &twin->torque_state, &torque),
        .v_plan = twin->motor.ref_v_ratio * twin->v_dc + twin->trim,
        .omega = twin->sample.omega,
        .torque_limit = twin->reference.torque_limit,
        .shift = shift,
        .psi_delta = twin->psi_delta,
        .i_d_max = twin_i_d_limit(&twin->motor, twin->psi_delta, twin->winding_C),
        .psi_q_delta = lq_error * fabs(twin->psi_ref.q),
    };
    twin->reference = twin_current_reference(&twin->motor, &request);
}

static void robust(twin_t *twin)
{
    const twin_point_t point = twin_point(&twin->motor, &twin->complete, twin->sample.omega);
    twin_identify(&twin->motor, &twin->identify, &point, twin->winding_C,
                  twin->identification && (twin->periods_on >= 3));
    twin->torque_estimated = twin->identify.torque;
    const double scale = twin->identify.kalman.x[6] * twin->motor.identify_sigma[6] * twin->identify.confidence;
    const double above = fabs(twin->sample.omega) / twin->motor.identify_omega_min_rad_s - 1.0;
    const double nominal = twin_iron_admittance(&twin->motor, twin->sample.omega) * twin_clamp(above, 0.0, 1.0);
    twin->iron_admittance = nominal * (1.0 + scale);
}

static void task(twin_t *twin)
{
    twin_mrai_in_t next = twin->sample;
    supervise(twin);
    if (twin->robust) {
        robust(twin);
    } else {
        twin->torque_estimated = twin->torque_mean.mean;
        twin->iron_admittance = 0.0;
    }
    if (twin->run_state == TWIN_RUN) {
        torque_path(twin);
        const twin_dq_t psi = {twin->psi_ref.d + twin->psi_delta, twin->psi_ref.q};
        twin->reference.i_ref = twin_iron_loss(&twin->motor, twin->reference.i_ref, twin->iron_admittance, psi);
        twin->i_ref = twin->current_mode ? (twin_dq_t){twin->id_command, twin->iq_command} : twin->reference.i_ref;
        twin->target = twin_current_target(&twin->motor, twin->i_ref, twin->sample.omega, twin->psi_delta,
                                           &twin->rotating);
        next.i = twin->i_ref;
        next.flux = twin_flux_table(&twin->motor, next.i);
        twin->psi_ref = (twin_dq_t){next.flux.psi_d, next.flux.psi_q};
    } else {
        twin->rotating = (twin_rotating_t){.psi = {twin->sample.flux.psi_d, twin->sample.flux.psi_q}};
        twin->torque_commanded = 0.0;
        twin->torque_state = (twin_torque_state_t){0};
        twin->reference = reference_start(twin);
        twin->limit.loss_W = 0.0;
        twin->trim = 0.0;
        twin->i_ref = (twin_dq_t){0.0, 0.0};
    }
    twin->schedule = twin_mrai_schedule(&twin->motor, &twin->quality, &twin->sample, &next, &twin->mrai,
                                        twin->identification && (twin->periods_on >= 3));
}

/* --- every period ----------------------------------------------------------------------------- */

static void identify(twin_t *twin)
{
    const twin_mrai_in_t *now = &twin->sample;
    if (twin->periods_on >= 3) { /* in the first three periods the voltage of the last period is unknown */
        twin_mrai(&twin->motor, &twin->schedule, &twin->mrai, now);
    } else {
        twin_mrai_reset(&twin->mrai, now);
    }
    (void)twin_torque_estimate(&twin->motor, &twin->torque_mean,
                               twin_torque(&twin->motor, now->i, &now->flux, twin->mrai.psi_delta));
    twin->psi_delta = twin->mrai.psi_delta;
}

static void collect(twin_t *twin, bool pulses_limited)
{
    const twin_mrai_in_t *now = &twin->sample;
    const twin_end_t end = {now->i, now->u, {now->flux.psi_d, now->flux.psi_q}, twin->theta};
    if (twin_window(&twin->motor, &twin->window, &end, twin->periods_on >= 3, pulses_limited)) {
        twin->complete = twin->window;
    }
    twin->psi_delta = twin->identify.psi_delta;
}

static void bridge_on(twin_t *twin, const twin_angle_t *angle, double out[4])
{
    const twin_mrai_in_t *now = &twin->sample;
    const twin_current_in_t request = {twin->target, &now->flux, now->omega, twin->v_dc};
    motor_si_t motor = twin->motor;
    motor.dead_time_duty *= twin->compensation;
    if (motor.turning_feedback > 0.0) {
        motor.knee_A = fmax(motor.knee_A, motor.turning_knee_A_per_rad * fabs(angle->step));
        const twin_turning_in_t far = {request, now->i, angle->step, twin->psi_delta};
        twin->u = twin_turning_control(&motor, &twin->turning, &far);
    } else {
        twin->u = twin_current_control(&motor, &twin->current, &request);
    }
    const twin_modulate_in_t voltage = {twin->u, now->i, angle->theta + 1.5 * angle->step, twin->v_dc};
    const twin_modulate_t m = twin_modulate(&motor, &voltage);
    twin->applied = m.applied;
    twin->modulation_limited = m.limited;
    twin->periods_on = (twin->periods_on < 3) ? twin->periods_on + 1 : 3;
    for (int x = 0; x < 3; x++) {
        out[x] = m.duty[x];
    }
    out[3] = 1.0;
}

static void bridge_off(twin_t *twin, double out[4])
{
    twin->u = (twin_dq_t){0.0, 0.0};
    twin->applied = (twin_dq_t){0.0, 0.0};
    twin->current = (twin_current_state_t){0};
    twin_turning_reset(&twin->turning, &twin->sample.flux);
    twin->modulation_limited = false;
    twin->periods_on = 0;
    out[0] = out[1] = out[2] = 0.5;
    out[3] = 0.0;
}

static void sample(twin_t *twin, const double in[6])
{
    for (int n = 0; n < 6; n++) {
        if (!isfinite(in[n])) {
            twin->fault_word |= TWIN_FAULT_INPUT;
            return; /* the last valid samples are kept */
        }
    }
    twin->last_i = (twin_abc_t){in[0], in[1], in[2]};
    twin->v_dc = in[3];
    twin->last_theta_m = in[4];
    twin->winding_C = in[5];
}

void twin_step(twin_t *twin, const double in[6], double out[4])
{
    sample(twin, in);
    const twin_angle_t angle = twin_angle_tracker(&twin->motor, &twin->tracker, twin->last_theta_m);
    twin->sample.i = twin_park(twin_clarke(twin->last_i), angle.theta);
    twin->sample.u = twin->applied; /* computed in the last period, acts in this one */
    twin->sample.omega = angle.omega;
    twin->theta = angle.theta;
    twin->sample.flux = twin_flux_table(&twin->motor, twin->sample.i);
    const unsigned found = faults(&twin->motor, &twin->monitor, twin->last_i, twin->v_dc);
    const bool run = twin->run_state == TWIN_RUN;
    twin->fault_word |= run ? found : found & ~(unsigned)TWIN_FAULT_UNDER_VOLTAGE;
    if (run && (twin->fault_word == 0U)) {
        bridge_on(twin, &angle, out);
    } else {
        bridge_off(twin, out);
    }
    if (twin->robust) {
        collect(twin, twin->modulation_limited);
    } else {
        identify(twin);
    }
    twin->periods++;
    if (twin->periods % (unsigned long)twin->motor.periods_per_step == 0) {
        task(twin);
    }
}
