/* SPDX-License-Identifier: Apache-2.0 */
#include <math.h>

#include "twin/twin_stages.h"

twin_measure_t twin_measure(const motor_si_t *motor, const twin_measure_config_t *config, const double counts[4])
{
    const double full = ldexp(1.0, motor->adc_bits);
    double i[3];
    for (int x = 0; x < 3; x++) {
        i[x] = (counts[x] - config->offset[x]) / (0.5 * full) * config->gain[x] * motor->current_full_scale_A;
    }
    const double v_dc = counts[3] / full * config->v_dc_gain * motor->v_dc_full_scale_V - motor->v_dc_offset_V;
    return (twin_measure_t){{i[0], i[1], i[2]}, v_dc};
}

twin_angle_t twin_angle_tracker(const motor_si_t *motor, twin_angle_state_t *state, double theta_m_rad)
{
    const double theta = twin_wrap(motor->pole_pairs * theta_m_rad);
    const double wn = motor->tracker_bandwidth_rad_s * motor->period_s;
    if (state->samples < 2) { /* the first two samples determine the first angle and speed */
        state->step = (state->samples == 1) ? twin_wrap(theta - state->theta) : 0.0;
        state->theta = theta;
        state->samples++;
    } else {
        const double e = twin_wrap(theta - state->theta - state->step);
        if (fabs(e) > motor->tracker_jump_turns * 2.0 * 3.14159265358979323846) { /* ignored: a jump */
            state->theta = twin_wrap(state->theta + state->step);
            return (twin_angle_t){state->theta, state->step, state->step / motor->period_s};
        }
        state->theta = twin_wrap(state->theta + state->step + 2.0 * wn * e);
        state->step += wn * wn * e;
    }
    return (twin_angle_t){theta, state->step, state->step / motor->period_s};
}

static double inverse_lookup(const twin_grid_t *grid, const double *l, double period, double x, double y)
{
    /* The firmware's table contains T_s/l, so T_s/l is interpolated here, too, and not l. */
    double corner[4];
    twin_grid_t cell = {0.0, grid->dx, 0.0, grid->dy, 2, 2};
    const double u = twin_clamp((x - grid->x0) / grid->dx, 0.0, grid->nx - 1);
    const double v = twin_clamp((y - grid->y0) / grid->dy, 0.0, grid->ny - 1);
    const int ix = (int)fmin(floor(u), grid->nx - 2);
    const int iy = (int)fmin(floor(v), grid->ny - 2);
    for (int n = 0; n < 4; n++) {
        corner[n] = period / l[(ix + n / 2) * grid->ny + iy + n % 2];
    }
    return twin_lookup(&cell, corner, (u - ix) * grid->dx, (v - iy) * grid->dy);
}

twin_flux_t twin_flux_table(const motor_si_t *motor, twin_dq_t i)
{
    const twin_grid_t grid = {motor->id0_A, motor->did_A, 0.0, motor->diq_A, motor->nd, motor->nq};
    const twin_grid_t row = {0.0, 1.0, 0.0, motor->diq_A, 1, motor->nq};
    const double iq = fabs(i.q);
    twin_flux_t f = {
        .l_d = twin_lookup(&grid, motor->l_d_H, i.d, iq),
        .l_q = twin_lookup(&grid, motor->l_q_H, i.d, iq),
        .l_dd = twin_lookup(&grid, motor->l_dd_H, i.d, iq),
        .l_qq = twin_lookup(&grid, motor->l_qq_H, i.d, iq),
        .g_d = inverse_lookup(&grid, motor->l_dd_H, motor->period_s, i.d, iq),
        .g_q = inverse_lookup(&grid, motor->l_qq_H, motor->period_s, i.d, iq),
        .psi_f0 = twin_lookup(&row, motor->psi_f0_Vs, 0.0, iq),
        .clamped = twin_outside(&grid, i.d, iq),
    };
    f.psi_d = f.psi_f0 + f.l_d * i.d;
    f.psi_q = f.l_q * i.q;
    return f;
}
