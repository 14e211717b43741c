/* SPDX-License-Identifier: Apache-2.0 */
#include "identify_fixture.h"

#include <math.h>

static int32_t q(double x, double one)
{
    return (int32_t)floor(x * one + 0.5);
}

static double noise(double volts, double base)
{
    return volts / base;
}

/* Assumed priors. Some are wide, so that every state changes. */
void identify_fixture(fixture_t *f, identify_config_t *c)
{
    static const double sigma_pu[IDENTIFY_STATES] = {0.0025, 0.002, 0.06, 0.06, 0.06, 0.005, 0.2};
    static const double leak[IDENTIFY_STATES] = {2e-4, 2e-4, 1e-4, 3e-5, 3e-5, 3e-5, 3e-5};
    const double unit[IDENTIFY_STATES] = {f->z, f->v, f->psi, 1.0, 1.0, 1.0, 1.0};
    const int n = f->si.periods_per_step;
    const double window = n * f->si.period_s;
    const double turns = f->w * window / (2.0 * 3.14159265358979323846);
    const double admittance = f->psi / (1.5 * f->i);
    *c = (identify_config_t){
        .l_shift = f->flux_table.l_shift,
        .r0 = f->mrai.r0,
        .r_per_dC = q(from_q31(f->mrai.r0) * 0.00039, 2147483648.0),
        .sinc_gain = f->mrai.sinc_gain,
        .mean_gain_q32 = q(0.5 / n, 4294967296.0),
        .rate_gain_q28 = q(1.0 / (f->w * window), 268435456.0),
        .window_turns_q29 = (uint32_t)q(turns, 536870912.0),
        .turn_to_pu = q(0.5 / turns, 65536.0),
        .iron_hysteresis = q(13.0 * admittance, 2147483648.0),
        .iron_eddy = q(0.01 * f->w * admittance, 2147483648.0),
        .iron_sign_gain = q(f->w / 30.0, 65536.0),
        .r_known_q30 = q(0.03, 1073741824.0),
        .noise_voltage_q30 = q(0.008, 1073741824.0),
        .noise_flux_q30 = q(0.03, 1073741824.0),
        .noise_rate_q30 = q(0.7, 1073741824.0),
        .omega_min = 655,
        .i_min = 983,
        .i_smooth = 491,
        .local_corner = 8520,
        .local_rate = q(0.05, 2147483648.0),
        .torque_min = 1500,
        .confidence_full = 983,
        .confidence_none = 1966,
        .confidence_rate = 655,
        .limited_noise = q(5.0 / n, 65536.0),
        .mismatch_rate = 3277,
    };
    motor_si_t *si = &f->si;
    for (int j = 0; j < IDENTIFY_STATES; j++) {
        c->sigma[j] = q(sigma_pu[j], 2147483648.0);
        c->leak[j] = q(leak[j], 2147483648.0);
        si->identify_sigma[j] = from_q31(c->sigma[j]) * unit[j];
        si->identify_leak[j] = from_q31(c->leak[j]);
    }
    si->r_temp_coeff_per_K = 10.0 * c->r_per_dC / (double)c->r0;
    si->iron_hysteresis = 13.0;
    si->iron_eddy = 0.01;
    si->iron_sign_rad_s = 30.0;
    si->identify_r_known = 0.03;
    si->identify_noise_V = noise(0.008, 1.0) * f->v;
    si->identify_noise_Vs = 0.03 * f->psi;
    si->identify_noise_rate = 0.7;
    si->identify_omega_min_rad_s = from_q15(c->omega_min) * f->w;
    si->identify_i_min_A = from_q15(c->i_min) * f->i;
    si->identify_i_smooth_A = from_q15(c->i_smooth) * f->i;
    si->identify_local_corner_rad_s = from_q15(c->local_corner) * f->w;
    si->identify_local_rate = from_q31(c->local_rate);
    si->identify_torque_min_Nm = from_q15(c->torque_min) * f->t;
    si->identify_confidence_full = from_q15(c->confidence_full);
    si->identify_confidence_none = from_q15(c->confidence_none);
    si->identify_limited_noise = 5.0 / n;
    si->identify_mismatch_rate = from_q15(c->mismatch_rate);
    si->identify_confidence_rate = from_q15(c->confidence_rate);
}

void identify_fixture_of(fixture_t *f, identify_config_t *config, int periods)
{
    const double theta = f->w * 1e-3 / periods;
    f->si.periods_per_step = periods;
    f->si.step_s = 1e-3;
    f->si.period_s = 1e-3 / periods;
    f->mrai.sinc_gain = q(theta * theta / 24.0, 2147483648.0);
    identify_fixture(f, config);
}

identify_tables_t tables_at(const fixture_t *f, dq_q15_t i_m)
{
    return (identify_tables_t){flux_table_step(&f->flux_table, i_m), flux_table_inductances(&f->flux_table, i_m)};
}

window_pair_t steady_window(const fixture_t *f, dq_q15_t i, double omega_pu, dq_q15_t extra_u)
{
    const flux_point_t flux = flux_table_step(&f->flux_table, i);
    const double r = from_q31(f->mrai.r0), theta_step = omega_pu * f->w * f->si.period_s;
    const double sinc =
        1.0 / (1.0 + theta_step * theta_step / 24.0); /* the voltage is constant in the stationary frame (MR-5) */
    const dq_q15_t u = {(int32_t)lround(sinc * (r * i.d - omega_pu * flux.psi_q + extra_u.d)),
                        (int32_t)lround(sinc * (r * i.q + omega_pu * flux.psi_d + extra_u.q))};
    window_pair_t pair = {.twin = {.count = f->si.periods_per_step}};
    for (int k = 0; k <= f->si.periods_per_step; k++) {
        const double theta = k * theta_step;
        const double turns = theta / 6.283185307179586;
        const identify_sample_t s = {i, u, &flux, (uint32_t)(int64_t)llround((turns - floor(turns)) * 4294967296.0)};
        const twin_end_t t = {{from_q15(i.d) * f->i, from_q15(i.q) * f->i},
                              {from_q15(u.d) * f->v, from_q15(u.q) * f->v},
                              {from_q15(flux.psi_d) * f->psi, from_q15(flux.psi_q) * f->psi},
                              theta};
        if (k == 0) {
            pair.fixed.last = (identify_end_t){{(q15_t)s.i.d, (q15_t)s.i.q},
                                               {(q15_t)s.u.d, (q15_t)s.u.q},
                                               {(q15_t)flux.psi_d, (q15_t)flux.psi_q},
                                               s.theta};
            identify_window_restart(&pair.fixed);
            pair.twin.last = t;
        } else {
            identify_window_add(&pair.fixed, &s);
            if (k == f->si.periods_per_step) {
                identify_window_end(&pair.fixed, &s);
            }
            (void)twin_window(&f->si, &pair.twin, &t, true, false);
        }
    }
    return pair;
}

double mean_on_the_chord(const fixture_t *f, dq_q15_t i_m, double psi_d, double psi_q, double omega_pu)
{
    enum { PIECES = 1000 };
    const flux_inductances_t l = flux_table_inductances(&f->flux_table, i_m);
    const double scale = ldexp(1.0, f->flux_table.l_shift), theta = omega_pu * f->w * f->si.period_s;
    double sum = 0.0;
    for (int k = 0; k < PIECES; k++) {
        const double s = (k + 0.5) / PIECES - 0.5; /* of the period, from its middle */
        /* In the frame of the rotor at mid-period, the ends are psi e^(-j theta/2) and psi e^(j theta/2). */
        const double along = cos(0.5 * theta), across = 2.0 * s * sin(0.5 * theta);
        const double x = psi_d * along - psi_q * across, y = psi_q * along + psi_d * across;
        const double rotor = s * theta;
        const double d = x * cos(rotor) + y * sin(rotor), q_axis = y * cos(rotor) - x * sin(rotor);
        const double i_d = from_q15(i_m.d) + (d - psi_d) / (from_q15(l.l_d) * scale);
        const double i_q = from_q15(i_m.q) + (q_axis - psi_q) / (from_q15(l.l_qq) * scale);
        sum += d * i_q - q_axis * i_d;
    }
    return sum / PIECES;
}
