/* SPDX-License-Identifier: Apache-2.0 */
#include <math.h>

#include "twin/twin_stages.h"

/* The integrator of one axis follows a reference that the voltage can realise. */
static double integral(const motor_si_t *motor, double e, double cut)
{
    const double realisable = e + cut / (motor->sigma_rad_s * motor->setpoint_weight);
    return motor->sigma_rad_s * motor->integral_ratio * realisable;
}

/* The circle: d first while it takes flux away, the direction of the whole while it asks for flux back. What d is
 * short of is taken off the q flux that binds it. */
static twin_dq_t circle(twin_dq_t u, double u_max, bool more_flux, double omega)
{
    const double length = hypot(u.d, u.q);
    if (more_flux) {
        const double share = (length > u_max) ? u_max / length : 1.0;
        return (twin_dq_t){share * u.d, share * u.q};
    }
    const double d = twin_clamp(u.d, -31.0 / 32.0 * u_max, 31.0 / 32.0 * u_max);
    const double room = sqrt(u_max * u_max - d * d);
    const double shed = (omega < 0.0) ? d - u.d : u.d - d;
    return (twin_dq_t){d, twin_clamp(u.q + shed, -room, room)};
}

twin_target_t twin_current_target(const motor_si_t *motor, twin_dq_t i_ref)
{
    const twin_flux_t at = twin_flux_table(motor, i_ref);
    const double less = 1.0 - motor->setpoint_weight;
    const double drop = motor->r_ohm_20 / motor->sigma_rad_s;
    return (twin_target_t){
        .psi = {at.psi_d, at.psi_q},
        .weighted = {at.psi_d - less * at.l_d * i_ref.d + drop * i_ref.d,
                     at.psi_q - less * at.l_q * i_ref.q + drop * i_ref.q},
    };
}

twin_dq_t twin_current_control(const motor_si_t *motor, twin_current_state_t *state,
                               const twin_current_in_t *in)
{
    const twin_flux_t *f = in->flux;
    const twin_target_t *to = &in->target;
    const double sigma = motor->sigma_rad_s;
    const double ud = sigma * (to->weighted.d - f->psi_d) + state->s.d - in->omega * f->psi_q;
    const double uq = sigma * (to->weighted.q - f->psi_q) + state->s.q +
                      in->omega * (f->psi_d + in->psi_delta);
    const twin_dq_t e = {to->psi.d - f->psi_d, to->psi.q - f->psi_q};
    const twin_dq_t u = circle((twin_dq_t){ud, uq}, motor->v_ratio * in->v_dc, e.d > 0.0, in->omega);
    state->limited = (u.d != ud) || (u.q != uq);
    state->s.d += integral(motor, e.d, u.d - ud);
    state->s.q += integral(motor, e.q, u.q - uq);
    return u;
}

static double snap(double duty, double min_pulse)
{
    const double d = twin_clamp(duty, 0.0, 1.0);
    if (d < min_pulse) {
        return (d < 0.5 * min_pulse) ? 0.0 : min_pulse;
    }
    if (1.0 - d < min_pulse) {
        return (1.0 - d < 0.5 * min_pulse) ? 1.0 : 1.0 - min_pulse;
    }
    return d;
}

twin_modulate_t twin_modulate(const motor_si_t *motor, const twin_modulate_in_t *in)
{
    const double v_dc = fmax(in->v_dc, motor->v_dc_min_V);
    const twin_abc_t u = twin_clarke_inverse(twin_park_inverse(in->u, in->theta));
    const twin_abc_t i = twin_clarke_inverse(twin_park_inverse(in->i, in->theta));
    const double v[3] = {u.a / v_dc, u.b / v_dc, u.c / v_dc};
    const double current[3] = {i.a, i.b, i.c};
    const double top = fmax(v[0], fmax(v[1], v[2]));
    const double bottom = fmin(v[0], fmin(v[1], v[2]));
    const double shorten = 1.0 / fmax(1.0, top - bottom);
    double made[3];
    twin_modulate_t out;
    for (int x = 0; x < 3; x++) {
        const double c = motor->dead_time_duty * twin_clamp(current[x] / motor->knee_A, -1.0, 1.0);
        const double d = 0.5 + shorten * (v[x] - 0.5 * (top + bottom)) + c;
        out.duty[x] = snap(d, motor->min_pulse_duty);
        /* A phase that does not switch loses nothing to the dead time. */
        const bool switches = (out.duty[x] > 0.0) && (out.duty[x] < 1.0);
        made[x] = (out.duty[x] - (switches ? c : 0.0)) * in->v_dc;
    }
    out.acted = twin_park(twin_clarke((twin_abc_t){made[0], made[1], made[2]}), in->theta);
    out.limited = hypot(out.acted.d - in->u.d, out.acted.q - in->u.q) > 1e-4 * motor->v_base_V;
    return out;
}
