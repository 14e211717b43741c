/* SPDX-License-Identifier: Apache-2.0 */
#include <math.h>

#include "twin/twin_stages.h"

/* Weight of the d equation (MR-7). */
static const double weight_d = 2.0;

void twin_mrai_reset(twin_mrai_state_t *state, const twin_mrai_in_t *in)
{
    state->e = (twin_dq_t){0.0, 0.0};
    state->psi_used = state->psi_delta;
    state->r_used = state->r_delta;
    state->last = *in;
}

/* One adaptation law: proportional part plus integral part; only the integral part is limited. */
static double adapt(double step, double proportional, double lo, double hi, double *integral, bool *clamped)
{
    *integral = twin_clamp(*integral + step, lo, hi);
    *clamped = (*integral <= lo) || (*integral >= hi);
    return *integral + proportional * step;
}

/* Resistive voltage drop plus rotational voltage at one instant. */
static twin_dq_t drop_and_rotational(const motor_si_t *motor, const twin_mrai_in_t *at, double psi_used, double r_used)
{
    const double r = motor->r_ohm_20 + r_used;
    return (twin_dq_t){r * at->i.d - at->omega * at->flux.psi_q, r * at->i.q + at->omega * (at->flux.psi_d + psi_used)};
}

/* Evaluates the voltage equation over the last period, with means and differences of the samples at its two ends. The
 * residual, a flux, is added to the observer error, which decays with the observer's poles. */
void twin_mrai(const motor_si_t *motor, const twin_mrai_schedule_t *schedule, twin_mrai_state_t *state,
               const twin_mrai_in_t *in)
{
    const twin_mrai_in_t *last = &state->last;
    const twin_dq_t e = state->e;
    /* S T_s/2 with S = m R (1/L_d + 1/L_q): independent of the speed. */
    const double s2 = 0.5 * motor->observer_m * motor->r_ohm_20 * (in->flux.g_d + in->flux.g_q);
    const double flux_step = -schedule->flux_gain * s2 * e.q;
    const double resistance_step = -schedule->resistance_gain * s2 * (weight_d * in->i.d * e.d + in->i.q * e.q);
    const twin_dq_t before = drop_and_rotational(motor, last, state->psi_used, state->r_used);
    state->psi_used = adapt(flux_step, motor->flux_proportional, motor->psi_delta_min_Vs, motor->psi_delta_max_Vs,
                            &state->psi_delta, &state->psi_clamped);
    state->r_used = adapt(resistance_step, motor->resistance_proportional, motor->r_delta_min_ohm,
                          motor->r_delta_max_ohm, &state->r_delta, &state->r_clamped);
    const twin_dq_t after = drop_and_rotational(motor, in, state->psi_used, state->r_used);
    const double t = motor->period_s;
    const twin_dq_t u = {last->u.d * schedule->voltage_scale, last->u.q * schedule->voltage_scale};
    state->e.d = e.d + weight_d * (in->flux.psi_d - last->flux.psi_d - t * (u.d - 0.5 * (before.d + after.d))) +
                 s2 * (e.q - e.d);
    state->e.q = e.q + in->flux.psi_q - last->flux.psi_q - t * (u.q - 0.5 * (before.q + after.q)) - s2 * (e.d + e.q);
    state->last = *in;
}

static double sinc(double x)
{
    return (fabs(x) < 1e-9) ? 1.0 : sin(x) / x;
}

/* The drift of a parameter per step shows how far it is from its final value. */
static double quality(double now, double rate, bool known, double drift, double full)
{
    const double target = known ? twin_clamp(1.0 - fabs(drift) / full, 0.0, 1.0) : 0.0;
    return now + rate * (target - now);
}

static double psi_full_drift(const motor_si_t *motor)
{
    return 0.05 * motor->psi_f_Vs * motor->flux_bandwidth_rad_s * motor->step_s;
}

/* Divisor of the resistance law. */
static double excitation(const twin_mrai_in_t *at)
{
    return weight_d * at->i.d * weight_d * at->i.d + at->i.q * at->i.q;
}

static void update_quality(const motor_si_t *motor, twin_mrai_quality_t *q, const twin_mrai_state_t *now,
                           bool adapt_flux, bool adapt_resistance)
{
    const double psi_full = psi_full_drift(motor);
    const double r_full = 0.2 * motor->r_ohm_20 * motor->resistance_bandwidth_rad_s * motor->step_s;
    q->psi_quality = quality(q->psi_quality, motor->quality_rate, adapt_flux && !now->psi_clamped,
                             now->psi_delta - q->psi_last, psi_full);
    q->r_quality = quality(q->r_quality, motor->quality_rate, adapt_resistance && !now->r_clamped,
                           now->r_delta - q->r_last, r_full);
    q->psi_last = now->psi_delta;
    q->r_last = now->r_delta;
}

twin_mrai_schedule_t twin_mrai_schedule(const motor_si_t *motor, twin_mrai_quality_t *quality_state,
                                        const twin_mrai_in_t *sample, const twin_mrai_in_t *next,
                                        const twin_mrai_state_t *identifier, bool enabled)
{
    const double w = sample->omega;
    const double magnitude = hypot(sample->i.d, sample->i.q);
    const bool adapt_flux = enabled && (fabs(w) >= motor->omega_min_rad_s) && (magnitude >= motor->i_min_A);
    const double psi_drift = identifier->psi_delta - quality_state->psi_last;
    const bool settled = fabs(psi_drift) <= 0.2 * psi_full_drift(motor);
    const bool adapt_resistance = adapt_flux && settled && (fabs(w) <= motor->omega_r_max_rad_s);
    /* A current step is over before the task runs again, so the gain must suit the current before and after it. */
    const double norm = fmax(excitation(sample), excitation(next));
    update_quality(motor, quality_state, identifier, adapt_flux, adapt_resistance);
    return (twin_mrai_schedule_t){
        .flux_gain = adapt_flux ? 2.0 * motor->flux_bandwidth_rad_s / w : 0.0,
        .resistance_gain = adapt_resistance ? 2.0 * motor->resistance_bandwidth_rad_s / norm : 0.0,
        .voltage_scale = 1.0 / sinc(0.5 * w * motor->period_s),
    };
}
