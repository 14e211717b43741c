/* SPDX-License-Identifier: Apache-2.0 */
#include "inverter.h"

#include "clamp.h"
#include "flux_solve.h"

#define SWEEPS 60
#define SWEEP_END_V 1e-7

static void voltage(const inverter_t *v, double vdc_V, const double error_V[3], double u_s[2])
{
    double leg[3];
    for (int x = 0; x < 3; x++) {
        leg[x] = vdc_V * v->duty[x] - error_V[x];
    }
    from_phases(leg, u_s);
    u_s[0] += v->series_V[0];
    u_s[1] += v->series_V[1];
}

/* (PL-29) at the start of a substep: up to the knee the error is proportional to the current, and reaches half of its
 * full value there; above it the value of this current acts up to the current at which the straight line reaches it. */
static void soften(inverter_t *v, const double i_abc[3])
{
    for (int x = 0; x < 3; x++) {
        if (v->knee_A[x] > 0.0) {
            const double share = 1.0 - 0.5 / fmax(fabs(i_abc[x]) / v->knee_A[x], 1.0);
            v->hi_V[x] = share * v->full_hi_V[x];
            v->lo_V[x] = share * v->full_lo_V[x];
            v->zone_A[x] = 2.0 * share * v->knee_A[x];
        }
    }
}

/* Whether the currents outside the zone keep the signs for which the errors were chosen. */
static int consistent(const inverter_t *v, const double error_V[3], const double i_abc[3])
{
    for (int x = 0; x < 3; x++) {
        if (v->hi_V[x] + v->lo_V[x] > 0.0 && !(error_V[x] > 0.0 ? i_abc[x] > v->zone_A[x] : i_abc[x] < -v->zone_A[x])) {
            return 0;
        }
    }
    return 1;
}

/* di_abc = -gain x error_V over one substep (PL-13). */
static void current_gain(const machine_t *m, double h, rotation_t end, double gain[3][3])
{
    for (int y = 0; y < 3; y++) {
        double dq[2], di[2], ab[2], abc[3];
        to_rotor(end, phase_axis[y], dq);
        flux_solve_step(m->jac, m->per_det, dq, di);
        to_stationary(end, di, ab);
        to_phases(ab, abc);
        for (int x = 0; x < 3; x++) {
            gain[x][y] = abc[x] * h * (2.0 / 3.0);
        }
    }
}

/* The frequent case in closed form: three equal legs that keep all currents at zero or inside the zone.
 * (h J^-1 + zone/bound) e = i_free in the rotor frame; without a zone the common mode of the errors is arbitrary and is
 * centred between the bounds. 0 if a leg's error would exceed its bound. */
static int hold_all(inverter_t *v, const machine_t *m, double h, rotation_t end, const double free_A[3])
{
    const double bound = v->hi_V[0], *jac = m->jac;
    for (int x = 0; x < 3; x++) {
        if (v->hi_V[x] != bound || v->lo_V[x] != bound) {
            return 0;
        }
    }
    const double zone = v->zone_A[0] / bound; /* bound > 0: without bounds v->exact is set */
    const double per_det = h / (jac[0] * jac[3] - jac[1] * jac[2]);
    const double a[4] = {jac[3] * per_det + zone, -jac[1] * per_det, -jac[2] * per_det, jac[0] * per_det + zone};
    double ab[2], dq[2], error_dq[2], e[3];
    from_phases(free_A, ab);
    to_rotor(end, ab, dq);
    flux_divide(a, dq, error_dq);
    to_stationary(end, error_dq, ab);
    to_phases(ab, e);
    const double top = fmax(e[0], fmax(e[1], e[2])), bottom = fmin(e[0], fmin(e[1], e[2]));
    const double shift = zone > 0.0 ? 0.0 : -0.5 * (top + bottom);
    if (top + shift > bound || bottom + shift < -bound) {
        return 0;
    }
    for (int x = 0; x < 3; x++) {
        v->error_V[x] = e[x] + shift;
    }
    return 1;
}

/* Projected Gauss-Seidel on the three legs; free_A: the currents at the end without any error. */
static void solve_errors(inverter_t *v, double gain[3][3], const double free_A[3])
{
    double change = 1.0;
    for (int n = 0; n < SWEEPS && change > SWEEP_END_V; n++) {
        change = 0.0;
        for (int x = 0; x < 3; x++) {
            const double *g = gain[x], *e = v->error_V;
            const double without_A = free_A[x] - (g[0] * e[0] + g[1] * e[1] + g[2] * e[2]) + g[x] * e[x];
            const double bound = without_A > 0.0 ? v->hi_V[x] : v->lo_V[x];
            if (bound > 0.0) {
                const double now = clamp(without_A / (g[x] + v->zone_A[x] / bound), -bound, bound);
                change = fmax(change, fabs(now - e[x]));
                v->error_V[x] = now;
            } else {
                v->error_V[x] = 0.0;
            }
        }
    }
}

void inverter_voltage(inverter_t *v, const machine_t *m, double vdc_V, double h, rotation_t start, rotation_t end,
                      double u_s[2], double i_end_dq[2])
{
    double i[2], i_s[2], i_abc[3], error_V[3] = {0.0, 0.0, 0.0}, gain[3][3], free_A[3];
    if (!v->exact) {
        machine_current(m, i);
        to_stationary(start, i, i_s);
        to_phases(i_s, i_abc);
        soften(v, i_abc);
        for (int x = 0; x < 3; x++) {
            error_V[x] = i_abc[x] > 0.0 ? v->hi_V[x] : -v->lo_V[x];
        }
    }
    voltage(v, vdc_V, error_V, u_s);
    machine_predict(m, u_s, h, start, end, i_end_dq);
    if (!v->exact) {
        to_stationary(end, i_end_dq, i_s);
        to_phases(i_s, i_abc);
        if (!consistent(v, error_V, i_abc)) {
            current_gain(m, h, end, gain);
            for (int x = 0; x < 3; x++) {
                free_A[x] = i_abc[x] + gain[x][0] * error_V[0] + gain[x][1] * error_V[1] + gain[x][2] * error_V[2];
            }
            if (!hold_all(v, m, h, end, free_A)) {
                solve_errors(v, gain, free_A);
            }
            voltage(v, vdc_V, v->error_V, u_s);
            machine_predict(m, u_s, h, start, end, i_end_dq);
            return;
        }
    }
    for (int x = 0; x < 3; x++) {
        v->error_V[x] = error_V[x];
    }
}

double inverter_dc_current(const inverter_t *v, const double i_abc[3])
{
    double sum = 0.0;
    for (int x = 0; x < 3; x++) {
        const double e = v->error_V[x], bound = e > 0.0 ? v->full_hi_V[x] : v->full_lo_V[x];
        const double loss = e > 0.0 ? v->hi_d[x] : v->lo_d[x];
        sum += (v->duty[x] - (bound > 0.0 ? e / bound * loss : 0.0)) * i_abc[x];
    }
    return sum;
}
