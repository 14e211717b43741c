/* SPDX-License-Identifier: Apache-2.0 */
#include "twin/twin_identify.h"

#include <math.h>

enum { R, DROP, FLUX, LQ, LD, ANGLE, IRON, STEPS = 10, PREDICTION_STEP = 2 };

static const double x_max = 4.0, e_max_pu = 0.0625, mismatch_max = 0.5;

void twin_kalman_reset(twin_kalman_t *kalman)
{
    *kalman = (twin_kalman_t){0};
    for (int j = 0; j < TWIN_STATES; j++) {
        kalman->p[j][j] = 1.0;
    }
}

static double dot(const double a[TWIN_STATES], const double b[TWIN_STATES])
{
    double sum = 0.0;
    for (int j = 0; j < TWIN_STATES; j++) {
        sum += a[j] * b[j];
    }
    return sum;
}

static double variance(const twin_kalman_t *kalman, const double h[TWIN_STATES])
{
    double sum = 0.0;
    for (int j = 0; j < TWIN_STATES; j++) {
        sum += h[j] * dot(kalman->p[j], h);
    }
    return sum;
}

/* h and e are per unit: in these units e is limited to 1/16. */
bool twin_kalman_update(twin_kalman_t *kalman, const double h[TWIN_STATES], double e, double r)
{
    const double hph = variance(kalman, h);
    const double s = hph + r;
    double ph[TWIN_STATES];
    bool mismatch = e * e > 8.0 * hph + r;
    for (int j = 0; j < TWIN_STATES; j++) {
        ph[j] = dot(kalman->p[j], h);
    }
    for (int j = 0; j < TWIN_STATES; j++) {
        const double updated = kalman->x[j] + ph[j] / s * twin_clamp(e, -e_max_pu, e_max_pu);
        kalman->x[j] = twin_clamp(updated, -x_max, x_max);
        mismatch = mismatch || (kalman->x[j] != updated);
        for (int l = 0; l < TWIN_STATES; l++) {
            kalman->p[j][l] -= ph[j] * ph[l] / s;
        }
    }
    return mismatch;
}

void twin_kalman_predict(const motor_si_t *motor, twin_kalman_t *kalman, bool r_known)
{
    const double *leak = motor->identify_leak;
    for (int j = 0; j < TWIN_STATES; j++) {
        const double prior = ((j == R) && r_known) ? motor->identify_r_known : 1.0;
        kalman->x[j] -= leak[j] * kalman->x[j];
        for (int l = 0; l < TWIN_STATES; l++) {
            kalman->p[j][l] -= (leak[j] + leak[l]) * kalman->p[j][l];
        }
        kalman->p[j][j] += 2.0 * leak[j] * prior;
    }
}

void twin_identify_reset(const motor_si_t *motor, twin_identify_t *state)
{
    *state = (twin_identify_t){.r_prior = motor->r_ohm_20};
    twin_kalman_reset(&state->kalman);
}

static void average_step(const motor_si_t *motor, twin_identify_t *s, const twin_point_t *point, const twin_model_t *m,
                         twin_dq_t e, bool enabled)
{
    const double level = motor->identify_noise_V + fabs(point->omega) * motor->identify_noise_Vs +
                         motor->identify_noise_rate * (fabs(point->rate.d) + fabs(point->rate.q));
    s->update_valid = (s->update_valid || (s->steps == 0)) && point->valid && m->current && enabled;
    s->noise += level * (1.0 + motor->identify_limited_noise * point->limited) / STEPS;
    s->e.d += e.d / STEPS;
    s->e.q += e.q / STEPS;
    for (int j = 0; j < TWIN_STATES; j++) {
        s->mean_d[j] += m->d[j] / STEPS;
        s->mean_q[j] += m->q[j] / STEPS;
    }
    s->steps++;
}

/* One axis of the mean measurement, per unit as the limit of e. */
static bool update(const motor_si_t *motor, twin_identify_t *s, const double mean[TWIN_STATES], double e)
{
    double h[TWIN_STATES];
    for (int j = 0; j < TWIN_STATES; j++) {
        h[j] = mean[j] / motor->v_base_V;
    }
    return twin_kalman_update(&s->kalman, h, e / motor->v_base_V, pow(s->noise / motor->v_base_V, 2.0));
}

static void update_d_axis(const motor_si_t *motor, twin_identify_t *s)
{
    if (s->update_valid) {
        const double output_before = dot(s->mean_q, s->kalman.x);
        s->mismatch_d = update(motor, s, s->mean_d, s->e.d);
        s->e.q -= dot(s->mean_q, s->kalman.x) - output_before;
    }
    s->steps = 0;
}

static void update_q_axis(const motor_si_t *motor, twin_identify_t *s)
{
    if (s->update_valid) {
        const bool mismatch_q = update(motor, s, s->mean_q, s->e.q);
        s->mismatch_share += motor->identify_mismatch_rate * ((s->mismatch_d || mismatch_q) - s->mismatch_share);
    }
    for (int j = 0; j < TWIN_STATES; j++) {
        s->mean_d[j] = s->mean_q[j] = 0.0;
    }
    s->e = (twin_dq_t){0.0, 0.0};
    s->noise = 0.0;
}

static void update_confidence(const motor_si_t *motor, twin_identify_t *s, const twin_model_t *m)
{
    const double k = 1.5 * motor->pole_pairs;
    const double uncertain = k * sqrt(variance(&s->kalman, m->torque));
    const double prior = k * sqrt(dot(m->torque, m->torque));
    const double scale = fmax(fabs(s->torque), motor->identify_torque_min_Nm);
    const bool good = (uncertain < sqrt(0.375) * prior) ||
                      (uncertain < motor->identify_confidence_full * fabs(s->torque));
    const bool bad = (uncertain > sqrt(0.75) * prior) && (uncertain > motor->identify_confidence_none * scale);
    if (bad || (s->mismatch_share > mismatch_max)) {
        s->torque_certain = false;
    } else if (good) {
        s->torque_certain = true;
    }
    const double step = s->torque_certain ? motor->identify_confidence_rate : -motor->identify_confidence_rate;
    s->confidence = twin_clamp(s->confidence + step, 0.0, 1.0);
}

static void update_local_flux_error(const motor_si_t *motor, twin_identify_t *s, const twin_point_t *point, twin_dq_t e,
                                    bool enabled)
{
    const double w = point->omega;
    const double gain = enabled ? w / (w * w + pow(motor->identify_local_corner_rad_s, 2.0)) : 0.0;
    s->local.d += motor->identify_local_rate * (gain * e.q - s->local.d);
    s->local.q += motor->identify_local_rate * (-gain * e.d - s->local.q);
}

static void estimate_torque(const motor_si_t *motor, twin_identify_t *s, const twin_point_t *point,
                            const twin_model_t *m)
{
    double v[TWIN_STATES];
    for (int j = 0; j < TWIN_STATES; j++) {
        v[j] = s->kalman.x[j] * motor->identify_sigma[j];
    }
    const double magnet = v[FLUX] + v[LD] * m->slope;
    const double psi_d = m->psi.d + magnet + v[ANGLE] * m->angle_flux.d + v[IRON] * m->iron_psi.d + s->local.d;
    const double psi_q = m->psi.q * (1.0 + v[LQ]) + v[ANGLE] * m->angle_flux.q + v[IRON] * m->iron_psi.q + s->local.q;
    const twin_dq_t i = {point->i_m.d + v[IRON] * m->iron_i.d, point->i_m.q + v[IRON] * m->iron_i.q};
    const double sampled = psi_d * i.q - psi_q * i.d;
    const double chord = pow(point->omega * motor->period_s, 2.0) / 12.0;
    const double mean = sampled - chord * (sampled + psi_d * psi_q * (1.0 / m->l_qq - 1.0 / m->l_d));
    s->torque = 1.5 * motor->pole_pairs * mean;
    s->psi_delta = magnet;
}

void twin_identify(const motor_si_t *motor, twin_identify_t *s, const twin_point_t *point, double winding_C,
                   bool enabled)
{
    if (s->steps == 0) {
        update_q_axis(motor, s);
    }
    s->r_known = !isnan(winding_C);
    if (s->r_known) {
        s->r_prior = motor->r_ohm_20 * (1.0 + motor->r_temp_coeff_per_K * (winding_C - 20.0));
    }
    const twin_model_t m = twin_model(motor, point, s->r_prior);
    const twin_dq_t e = {m.y.d - dot(m.d, s->kalman.x), m.y.q - dot(m.q, s->kalman.x)};
    update_local_flux_error(motor, s, point, e, point->valid && enabled);
    average_step(motor, s, point, &m, e, enabled);
    estimate_torque(motor, s, point, &m);
    if (s->steps == PREDICTION_STEP) {
        twin_kalman_predict(motor, &s->kalman, s->r_known);
        update_confidence(motor, s, &m);
    } else if (s->steps == STEPS) {
        update_d_axis(motor, s);
    }
}
