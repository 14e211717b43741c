/* SPDX-License-Identifier: Apache-2.0 */
#include <math.h>

#include "twin/twin_stages.h"

double twin_torque(const motor_si_t *motor, twin_dq_t i, const twin_flux_t *flux, double psi_delta)
{
    return 1.5 * motor->pole_pairs * ((flux->psi_d + psi_delta) * i.q - flux->psi_q * i.d);
}

double twin_torque_estimate(const motor_si_t *motor, twin_torque_estimate_t *state, double torque_Nm)
{
    state->sum += torque_Nm;
    state->count++;
    if (state->count == motor->periods_per_step) {
        state->mean = state->sum / motor->periods_per_step;
        state->sum = 0.0;
        state->count = 0;
    }
    return state->mean;
}

double twin_torque_loop(const motor_si_t *motor, twin_torque_state_t *state, const twin_torque_in_t *in)
{
    const double authority = motor->torque_authority * in->confidence;
    const double limit = authority * fabs(in->torque_commanded);
    const double direction = (in->torque_commanded > 0.0) - (in->torque_commanded < 0.0);
    /* The estimate is a mean over the last step and is compared with the model's value before this step. */
    const double e = state->model - in->torque_estimated;
    state->model += motor->torque_model_rate * (in->torque_commanded - state->model);
    double p = 0.0;
    if (!in->enabled) {
        state->correction -= motor->torque_ki * state->correction;
    } else {
        p = motor->torque_kp * e;
    }
    if (in->enabled && (fabs(in->torque_commanded) >= 0.5 * motor->torque_min_Nm)) {
        /* The relative error is limited to 100 %. */
        const double relative = e * direction / fmax(fabs(in->torque_commanded), motor->torque_min_Nm);
        const double moved = state->correction + motor->torque_ki * twin_clamp(relative, -1.0, 1.0);
        /* While voltage or reference are limited, the correction may not rise above 0, and decays from above 0. */
        const double kept = state->correction * (1.0 - motor->torque_ki / 4.0);
        const double max = in->limited ? fmax(kept, 0.0) : 1e9;
        state->correction = fmin(moved, max);
    }
    state->saturated = fabs(state->correction) >= authority;
    state->correction = twin_clamp(state->correction, -authority, authority);
    const double wanted = in->torque_commanded * state->correction + p;
    return in->torque_commanded + twin_clamp(wanted, -limit, limit);
}

/* (CR-2), (CR-9); beyond the table's flux by so much that the shift has no effect. */
static double planned_flux(const motor_si_t *motor, const twin_reference_in_t *in, double torque_Nm)
{
    const double w = fabs(in->omega);
    const double power = (in->torque_corrected * in->omega < 0.0) ? 0.0 : torque_Nm * w / (1.5 * motor->pole_pairs);
    const double u = fmax(in->v_plan, 0.0);
    const double emf = sqrt(fmax(u * u - 2.0 * motor->r_ohm_20 * power, 0.0));
    const double psi_far_top = motor->psi0_Vs + motor->psi_step_Vs * (motor->ref_npsi - 1) + fabs(in->shift);
    return (emf >= w * (psi_far_top + fabs(in->shift))) ? psi_far_top : fmax(emf / w - in->shift, 0.0);
}

twin_reference_t twin_current_reference(const motor_si_t *motor, const twin_reference_in_t *in)
{
    const twin_grid_t grid = {0.0,           motor->torque_step_Nm, motor->psi0_Vs, motor->psi_step_Vs,
                              motor->ref_nt, motor->ref_npsi};
    const twin_grid_t row = {0.0, 1.0, motor->psi0_Vs, motor->psi_step_Vs, 1, motor->ref_npsi};
    const double psi_top = motor->psi0_Vs + motor->psi_step_Vs * (motor->ref_npsi - 1);
    const double planned_max = planned_flux(motor, in, in->torque_limit);
    const double t_max = twin_lookup(&row, motor->ref_torque_max_Nm, 0.0, fmin(planned_max, psi_top));
    const double t = fmin(fabs(in->torque_corrected), t_max);
    const double psi = fmin(planned_flux(motor, in, fmin(fabs(in->torque_corrected), in->torque_limit)), psi_top);
    const double iq = twin_lookup(&grid, motor->ref_iq_A, t, psi);
    const double psi_far = planned_max + fmin(in->shift, 0.0);
    const double t_far = twin_lookup(&row, motor->ref_torque_max_Nm, 0.0, psi_far);
    const double iq_far = twin_lookup(&grid, motor->ref_iq_A, t_far, psi_far);
    const double id_far = twin_lookup(&grid, motor->ref_id_A, t_far, psi_far);
    const double k = 1.5 * motor->pole_pairs;
    const double reach = fmax(t_far + k * (in->psi_delta * iq_far - in->psi_q_delta * id_far), 0.0);
    return (twin_reference_t){
        .i_ref = {fmax(twin_lookup(&grid, motor->ref_id_A, t, psi), -in->i_d_max),
                  (in->torque_corrected < 0.0) ? -iq : iq},
        .torque_max = reach,
        .torque_limit = in->torque_limit + (reach - in->torque_limit) / 4.0,
        .psi_plan = psi,
        .limited = fabs(in->torque_corrected) > t_max,
    };
}

twin_dq_t twin_iron_loss(const motor_si_t *motor, twin_dq_t i_m, double admittance, twin_dq_t psi)
{
    const double i_max = motor->i_max_A;
    const double flowing = fmin(16.0 * (fabs(i_m.d) + fabs(i_m.q)) / i_max, 1.0);
    const twin_dq_t iron = {-admittance * flowing * psi.q, admittance * flowing * psi.d};
    const double length = hypot(i_m.d + iron.d, i_m.q + iron.q);
    const double length_m = hypot(i_m.d, i_m.q);
    double share = 1.0;
    if (length > i_max) {
        const double more = length * length - length_m * length_m;
        share = (more > 0.0) ? fmax(i_max * i_max - length_m * length_m, 0.0) / more : 0.0;
    }
    return (twin_dq_t){i_m.d + share * iron.d, i_m.q + share * iron.q};
}

double twin_voltage_reserve(const motor_si_t *motor, double *trim, const twin_reserve_in_t *in)
{
    const double psi = hypot(in->psi.d, in->psi.q);
    const double e = motor->ref_v_ratio * in->v_dc - hypot(in->u.d, in->u.q);
    const bool on_limit = psi > in->psi_plan * 31.0 / 32.0;
    *trim += motor->trim_gain * ((in->acting && (e < 0.0 || on_limit)) ? e : -*trim);
    *trim = twin_clamp(*trim, motor->trim_min_V, motor->trim_max_ratio * in->v_dc);
    return hypot(in->psi.d + in->psi_delta, in->psi.q) - psi;
}
