/* SPDX-License-Identifier: Apache-2.0 */
#include <math.h>

#include "twin/twin_stages.h"

/* Anti-windup: the integrator of one axis follows the reference that the limited voltage can realise.
 * limiting: limited minus unlimited voltage. */
static double integral(const motor_si_t *motor, double e, double limiting)
{
    const double realisable = e + limiting / (motor->sigma_rad_s * motor->setpoint_weight);
    return motor->sigma_rad_s * motor->integral_ratio * realisable;
}

/* Largest value of one axis for which the vector stays inside the unit circle when the other axis is x. As in the
 * firmware's table, |x| is rounded up to the next 1/256 and the result is at least 1/4. */
static double remaining_voltage(double x)
{
    const double end = (fmin(floor(fabs(x) * 256.0), 255.0) + 1.0) / 256.0;
    return fmax(sqrt(1.0 - end * end), 0.25);
}

/* The voltage circle. While the d flux must fall and v_d is negative, the d axis has priority; otherwise d gets what q
 * leaves, at least 0.7 of the radius, or 0.5 if q alone would need 1.5. What d lacks is subtracted from q, which gets
 * the rest. */
static twin_dq_t circle(twin_dq_t u, double u_max, bool less_flux, double omega)
{
    const twin_dq_t v = {u.d / u_max, u.q / u_max};
    const bool d_first = less_flux && v.d < 0.0;
    const double d_least = (fabs(v.q) < 1.5) ? 0.7 : 127.5 / 256.0;
    const double d_max = d_first ? 1.0 : fmax(remaining_voltage(twin_clamp(v.q, -1.0, 1.0)), d_least);
    const double d = twin_clamp(v.d, -d_max, d_max);
    const double missing = twin_clamp(v.d - d, -1.0, 1.0);
    const double left = remaining_voltage(d);
    const double q = v.q + ((omega < 0.0) ? -missing : missing);
    return (twin_dq_t){u_max * d, u_max * twin_clamp(q, -left, left)};
}

/* Of the rotational voltage, by the measured flux. */
static const double measured_share = 11.0 / 32.0;

static twin_dq_t sum(twin_dq_t a, double factor, twin_dq_t b)
{
    return (twin_dq_t){a.d + factor * b.d, a.q + factor * b.q};
}

static void follow(twin_rotating_t *r, twin_dq_t to, double psi_magnet)
{
    const twin_dq_t change = {to.d - r->psi.d, to.q - r->psi.q};
    const double at_once = psi_magnet * (r->behind ? 1.0 / 16.0 : 0.75);
    double share = 1.0;
    if (fmax(fabs(change.d), fabs(change.q)) > at_once) {
        share = r->behind ? 0.75 : 0.5;
    }
    r->behind = share < 1.0;
    r->psi = sum(r->psi, share, change);
}

twin_target_t twin_current_target(const motor_si_t *motor, twin_dq_t i_ref, double omega, double psi_delta,
                                  twin_rotating_t *rotating)
{
    const twin_flux_t at = twin_flux_table(motor, i_ref);
    const double less = 1.0 - motor->setpoint_weight;
    const double drop = motor->r_ohm_20 / motor->sigma_rad_s;
    const double rest = (1.0 - measured_share) * omega;
    const double per_sigma = 1.0 / motor->sigma_rad_s;
    const double d = at.psi_d - less * at.l_d * i_ref.d;
    const double q = at.psi_q - less * at.l_q * i_ref.q;
    follow(rotating, (twin_dq_t){d, q}, at.psi_d - at.l_d * i_ref.d);
    const twin_dq_t r = rotating->psi;
    return (twin_target_t){
        .psi = {at.psi_d, at.psi_q},
        .weighted = {d + drop * i_ref.d - per_sigma * rest * r.q,
                     q + drop * i_ref.q + per_sigma * (rest * r.d + omega * psi_delta)},
        .turn = measured_share * omega,
        .integral_turn = motor->integral_ratio * rest,
    };
}

twin_dq_t twin_current_control(const motor_si_t *motor, twin_current_state_t *state, const twin_current_in_t *in)
{
    const twin_flux_t *f = in->flux;
    const twin_target_t *to = &in->target;
    const double sigma = motor->sigma_rad_s;
    const double ud = sigma * (to->weighted.d - f->psi_d) + state->s.d - to->turn * f->psi_q;
    const double uq = sigma * (to->weighted.q - f->psi_q) + state->s.q + to->turn * f->psi_d;
    const twin_dq_t e = {to->psi.d - f->psi_d, to->psi.q - f->psi_q};
    const twin_dq_t u = circle((twin_dq_t){ud, uq}, motor->v_ratio * in->v_dc, e.d < 0.0, in->omega);
    const double rounding = 1e-9 * motor->v_base_V;
    state->limited = fabs(u.d - ud) > rounding || fabs(u.q - uq) > rounding;
    const double max = 4.0 * motor->v_ratio * in->v_dc;
    state->s.d += integral(motor, e.d, twin_clamp(u.d - ud, -max, max)) - to->integral_turn * e.q;
    state->s.q += integral(motor, e.q, twin_clamp(u.q - uq, -max, max)) + to->integral_turn * e.d;
    return u;
}

void twin_turning_reset(twin_turning_state_t *state, const twin_flux_t *flux)
{
    const twin_dq_t psi = {flux->psi_d, flux->psi_q};
    *state = (twin_turning_state_t){.now = psi, .next = psi};
}

/* x e^(j angle). */
static twin_dq_t turned(twin_dq_t x, double angle)
{
    const twin_ab_t y = twin_park_inverse(x, angle);
    return (twin_dq_t){y.alpha, y.beta};
}

/* e^(j theta/2) to - e^(-j theta/2) from: the flux of the period that leads from one to the other. */
static twin_dq_t between(twin_dq_t from, twin_dq_t to, double theta)
{
    return sum(turned(to, 0.5 * theta), -1.0, turned(from, -0.5 * theta));
}

twin_dq_t twin_turning_control(const motor_si_t *motor, twin_turning_state_t *state, const twin_turning_in_t *in)
{
    const twin_current_in_t *c = &in->control;
    const double theta = in->step;
    const twin_dq_t magnet = {in->psi_delta, 0.0};
    const twin_dq_t e = {state->now.d - c->flux->psi_d, state->now.q - c->flux->psi_q};
    const twin_dq_t to = sum(state->next, motor->turning_approach, sum(c->target.psi, -1.0, state->next));
    const twin_dq_t model = between(sum(state->next, 1.0, magnet), sum(to, 1.0, magnet), theta);
    const twin_dq_t fed_back = turned(e, -1.5 * theta);
    const twin_dq_t flux = sum(model, motor->turning_feedback, fed_back);
    state->unlimited = sum(sum(state->s, 1.0 / motor->period_s, flux), motor->r_ohm_20, in->i);
    const double max = motor->v_ratio * c->v_dc;
    const twin_dq_t u = circle(state->unlimited, max, c->target.psi.d < c->flux->psi_d, c->omega);
    const twin_dq_t cut = {twin_clamp(u.d - state->unlimited.d, -4.0 * max, 4.0 * max),
                           twin_clamp(u.q - state->unlimited.q, -4.0 * max, 4.0 * max)};
    const double rounding = 1e-9 * motor->v_base_V;
    state->limited = fabs(cut.d) > rounding || fabs(cut.q) > rounding;
    const twin_dq_t direction = sum(between(e, e, theta), motor->turning_feedback, fed_back);
    state->s = sum(state->s, motor->turning_integral / motor->period_s, direction);
    state->now = state->next;
    state->next = sum(to, motor->period_s, turned(cut, -0.5 * theta));
    return u;
}

static double limit_pulse(double duty, double min_pulse)
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
    const double v_dc = in->v_dc;
    const twin_abc_t u = twin_clarke_inverse(twin_park_inverse(in->u, in->theta));
    const twin_abc_t i = twin_clarke_inverse(twin_park_inverse(in->i, in->theta));
    const double v[3] = {u.a / v_dc, u.b / v_dc, u.c / v_dc};
    const double current[3] = {i.a, i.b, i.c};
    const double top = fmax(v[0], fmax(v[1], v[2]));
    const double bottom = fmin(v[0], fmin(v[1], v[2]));
    double leg_voltage[3];
    twin_modulate_t out;
    for (int x = 0; x < 3; x++) {
        const double c = motor->dead_time_duty * twin_clamp(current[x] / motor->knee_A, -1.0, 1.0);
        const double d = 0.5 + v[x] - 0.5 * (top + bottom) + c;
        out.duty[x] = limit_pulse(d, motor->min_pulse_duty);
        /* A phase that does not switch loses nothing to the dead time. */
        const bool switches = (out.duty[x] > 0.0) && (out.duty[x] < 1.0);
        leg_voltage[x] = (out.duty[x] - (switches ? c : 0.0)) * in->v_dc;
    }
    out.applied = twin_park(twin_clarke((twin_abc_t){leg_voltage[0], leg_voltage[1], leg_voltage[2]}), in->theta);
    out.limited = hypot(out.applied.d - in->u.d, out.applied.q - in->u.q) > 1e-4 * motor->v_base_V;
    return out;
}
