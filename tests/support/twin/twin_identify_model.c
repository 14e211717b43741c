/* SPDX-License-Identifier: Apache-2.0 */
#include <math.h>

#include "twin/twin_identify.h"

static const double two_pi = 6.283185307179586476925;

bool twin_window(const motor_si_t *motor, twin_window_t *window, const twin_end_t *sample, bool acting, bool limited)
{
    if (window->count >= motor->periods_per_step) {
        *window = (twin_window_t){.first = window->last, .acting = true};
    }
    window->sum_i.d += sample->i.d;
    window->sum_i.q += sample->i.q;
    window->sum_u.d += sample->u.d;
    window->sum_u.q += sample->u.q;
    window->acting = window->acting && acting;
    window->limited += limited;
    window->count++;
    window->last = *sample;
    return window->count == motor->periods_per_step;
}

static double trapezoid(double sum, double first, double last, int n)
{
    return (sum - 0.5 * last + 0.5 * first) / n;
}

double twin_iron_admittance(const motor_si_t *motor, double omega)
{
    const double sign = twin_clamp(omega / motor->iron_sign_rad_s, -1.0, 1.0);
    return (motor->iron_hysteresis * sign + motor->iron_eddy * omega) / 1.5;
}

twin_point_t twin_point(const motor_si_t *motor, const twin_window_t *window, double omega_tracked)
{
    const int n = motor->periods_per_step;
    const double time = n * motor->period_s;
    const twin_end_t *a = &window->first;
    const twin_end_t *b = &window->last;
    const double turned = remainder(b->theta - a->theta - omega_tracked * time, two_pi);
    const double w = omega_tracked + turned / time;
    const double sinc = pow(w * motor->period_s, 2.0) / 24.0;
    const double iron = twin_iron_admittance(motor, w);
    const twin_dq_t i = {trapezoid(window->sum_i.d, a->i.d, b->i.d, n), trapezoid(window->sum_i.q, a->i.q, b->i.q, n)};
    const double u_gain = (1.0 + sinc) / n;
    const double rate_gain = (1.0 - 2.0 * sinc) / time;
    return (twin_point_t){
        .i = i,
        .u = {(window->sum_u.d - b->u.d + a->u.d) * u_gain, (window->sum_u.q - b->u.q + a->u.q) * u_gain},
        .rate = {(b->psi.d - a->psi.d) * rate_gain, (b->psi.q - a->psi.q) * rate_gain},
        .i_m = {i.d + 0.5 * iron * (a->psi.q + b->psi.q), i.q - 0.5 * iron * (a->psi.d + b->psi.d)},
        .omega = w,
        .iron = iron,
        .limited = window->limited,
        .valid = window->acting && (fabs(w) >= motor->identify_omega_min_rad_s),
    };
}

static void scale(const motor_si_t *motor, double h[TWIN_STATES])
{
    for (int j = 0; j < TWIN_STATES; j++) {
        h[j] *= motor->identify_sigma[j];
    }
}

twin_model_t twin_model(const motor_si_t *motor, const twin_point_t *p, double r)
{
    const twin_flux_t f = twin_flux_table(motor, p->i_m);
    const double w = p->omega;
    const double length = hypot(p->i.d, p->i.q);
    const double n = 1.0 / fmax(length, motor->identify_i_smooth_A);
    twin_model_t m = {.psi = {f.psi_d, f.psi_q}, .slope = f.psi_d - f.psi_f0, .l_d = f.l_d, .l_qq = f.l_qq};
    m.iron_i = (twin_dq_t){p->iron * f.psi_q, -p->iron * f.psi_d};
    m.iron_psi = (twin_dq_t){f.l_d * m.iron_i.d, f.l_qq * m.iron_i.q};
    m.angle_flux = (twin_dq_t){f.psi_q - f.l_d * p->i_m.q, f.l_qq * p->i_m.d - f.psi_d};
    m.current = length >= motor->identify_i_min_A;
    m.y.d = p->u.d - r * p->i.d + w * f.psi_q - p->rate.d;
    m.y.q = p->u.q - r * p->i.q - w * f.psi_d - p->rate.q;
    const double d[TWIN_STATES] = {p->i.d, p->i.d * n, 0.0, -w * f.psi_q, 0.0, -w * m.angle_flux.q, -w * m.iron_psi.q};
    const double q[TWIN_STATES] = {p->i.q, p->i.q * n, w, 0.0, w * m.slope, w * m.angle_flux.d, w * m.iron_psi.d};
    const double iron = m.iron_psi.d * p->i_m.q - m.iron_psi.q * p->i_m.d + f.psi_d * m.iron_i.q - f.psi_q * m.iron_i.d;
    const double t[TWIN_STATES] = {0.0,
                                   0.0,
                                   p->i_m.q,
                                   -f.psi_q * p->i_m.d,
                                   m.slope * p->i_m.q,
                                   m.angle_flux.d * p->i_m.q - m.angle_flux.q * p->i_m.d,
                                   iron};
    for (int j = 0; j < TWIN_STATES; j++) {
        m.d[j] = d[j];
        m.q[j] = q[j];
        m.torque[j] = t[j];
    }
    scale(motor, m.d);
    scale(motor, m.q);
    scale(motor, m.torque);
    return m;
}
