/* SPDX-License-Identifier: Apache-2.0 */
#include <math.h>

#include "twin/twin_stages.h"

/* Derating line: 0 at `end`, 1 at `start`, linear between them, constant beyond. */
static double line(double end, double start, double x)
{
    return twin_clamp((x - end) / (start - end), 0.0, 1.0);
}

/* An unknown temperature (NaN) derates to one half, but only if the sensor has worked before. */
static double thermal(double end, double start, double celsius, bool *seen)
{
    if (isnan(celsius)) {
        return *seen ? 0.5 : 1.0;
    }
    *seen = true;
    return line(end, start, celsius);
}

static double loss(const motor_si_t *m, twin_limit_state_t *state, const twin_limit_in_t *in)
{
    const double mechanical = in->torque_estimated * in->omega / m->pole_pairs;
    const double electrical = 1.5 * (in->u.d * in->i.d + in->u.q * in->i.q);
    const double now = electrical - mechanical + 1.5 * m->loss_drop_V * hypot(in->i.d, in->i.q);
    const double loss_max_W = 0.25 * 1.5 * m->v_base_V * m->i_base_A;
    state->loss_W = twin_clamp(state->loss_W + m->loss_rate * (now - state->loss_W), 0.0, loss_max_W);
    return state->loss_W;
}

double twin_torque_limit(const motor_si_t *m, twin_limit_state_t *state, const twin_limit_in_t *in)
{
    const double speed = fabs(in->omega);
    const double loss_W = loss(m, state, in);
    const double hot = fmin(thermal(m->inverter_end_C, m->inverter_start_C, in->inverter_C, &state->inverter_seen),
                            thermal(m->winding_end_C, m->winding_start_C, in->winding_C, &state->winding_seen));
    const double both = fmin(m->torque_max_Nm * hot, in->reach);
    const double low = fmin(line(m->dc_low_end_V, m->dc_low_start_V, in->v_dc),
                            line(m->speed_end_rad_s, m->speed_start_rad_s, speed));
    const double high = line(m->dc_high_end_V, m->dc_high_start_V, in->v_dc);
    const double shaft = speed / m->pole_pairs;
    const double drive = fmin(fmin(both, m->torque_max_Nm * low),
                              fmin(in->torque_drive, fmax(in->power_drive - loss_W, 0.0) / shaft));
    const double regen = fmin(fmin(both, m->torque_max_Nm * high),
                              fmin(in->torque_regen, fmax(in->power_regen + loss_W, 0.0) / shaft));
    const double moving = line(m->moving_end_rad_s, m->moving_start_rad_s, speed);
    const double against_rotation = drive + moving * (regen - drive);
    return (in->omega < 0.0) ? twin_clamp(in->torque_arbitrated, -drive, against_rotation)
                             : twin_clamp(in->torque_arbitrated, -against_rotation, drive);
}

double twin_i_d_limit(const motor_si_t *m, double psi_delta, double winding_C)
{
    const double magnet_C = fmin(20.0 + psi_delta / (m->psi_f_Vs * m->psi_temp_coeff_per_K), m->magnet_assumed_C);
    const double celsius = isnan(winding_C) ? m->magnet_assumed_C : fmax(winding_C, magnet_C);
    return twin_clamp(m->i_d_20_A - m->i_d_slope_A_per_K * (celsius - 20.0), 0.0, m->i_max_A);
}
