/* SPDX-License-Identifier: Apache-2.0 */
#include "machine.h"

#include "flux_solve.h"

#include <string.h>

/* Below this electrical speed the hysteresis torque changes sign gradually (PL-8). */
#define IRON_SIGN_RAD_S 1.0

static flux_model_t model_of(const machine_t *m, const plant_params_t *p, const plant_map_t *map)
{
    const double magnet = p->magnet_scale * (1.0 + p->magnet_temp_coeff_per_K * (p->rotor_C - 20.0));
    const double nominal = map != NULL ? m->psi_nominal_Vs : p->psi_f_Vs;
    const double cross = map != NULL ? p->cross_saturation_scale : 0.0;
    return (flux_model_t){.map = map,
                          .ld_H = p->ld_H * p->ld_slope_scale,
                          .lq_H = p->lq_H * p->lq_scale,
                          .slope = p->ld_slope_scale,
                          .cross = cross - p->ld_slope_scale,
                          .q = p->lq_scale,
                          .offset_Vs = (magnet - cross) * nominal,
                          .psi_f_Vs = magnet * nominal};
}

static void model_flux(const void *context, const double i[2], double psi[2], double jac[4])
{
    const flux_model_t *f = context;
    if (f->map == NULL) {
        jac[0] = f->ld_H;
        jac[1] = jac[2] = 0.0;
        jac[3] = f->lq_H;
        psi[0] = f->ld_H * i[0] + f->offset_Vs;
        psi[1] = f->lq_H * i[1];
        return;
    }
    double slope_H = 0.0, axis_Vs = 0.0;
    if (f->cross != 0.0) {
        axis_Vs = plant_map_both(f->map, i, psi, jac, &slope_H);
    } else {
        plant_map_flux(f->map, i[0], i[1], &psi[0], &psi[1], jac);
    }
    psi[0] = f->slope * psi[0] + f->offset_Vs;
    psi[1] *= f->q;
    jac[0] *= f->slope;
    jac[1] *= f->slope;
    jac[2] *= f->q;
    jac[3] *= f->q;
    if (f->cross != 0.0) {
        psi[0] += f->cross * axis_Vs;
        jac[1] += f->cross * slope_H;
    }
}

/* Searches the currents of psi_dq, starting at i. If none is found, or if the inductance matrix is singular there, the
 * failure is counted, and currents and slopes keep their last values, which are finite. */
static void search_current(machine_t *m, double i[2])
{
    double jac[4];
    if (flux_solve(model_flux, &m->flux, m->psi_dq, i, jac) != 0 || jac[0] * jac[3] == jac[1] * jac[2]) {
        m->failures++;
        return;
    }
    memcpy(m->im_dq, i, sizeof m->im_dq);
    memcpy(m->jac, jac, sizeof jac);
    m->per_det = flux_per_det(jac);
}

/* start is the linear prediction: one Newton step usually suffices. If the step is larger than 1e-3 A, its quadratic
 * error may exceed the tolerance and the full search follows. */
static void find_current(machine_t *m, const double start[2])
{
    double i[2] = {start[0], start[1]}, psi[2], r[2], step[2], jac[4];
    model_flux(&m->flux, i, psi, jac);
    r[0] = m->psi_dq[0] - psi[0];
    r[1] = m->psi_dq[1] - psi[1];
    const double per_det = flux_per_det(jac);
    flux_solve_step(jac, per_det, r, step);
    i[0] += step[0];
    i[1] += step[1];
    if (fabs(step[0]) + fabs(step[1]) < 1e-3) {
        memcpy(m->im_dq, i, sizeof i);
        memcpy(m->jac, jac, sizeof jac);
        m->per_det = per_det;
        return;
    }
    if (!isfinite(i[0]) || !isfinite(i[1])) {
        memcpy(i, m->im_dq, sizeof i);
    }
    search_current(m, i);
}

static void set_flux_from_current(machine_t *m, rotation_t rotor)
{
    model_flux(&m->flux, m->im_dq, m->psi_dq, m->jac);
    m->per_det = flux_per_det(m->jac);
    to_stationary(rotor, m->psi_dq, m->psi_s);
}

void machine_create(machine_t *m, const plant_params_t *p, const plant_map_t *map)
{
    double psi_q;
    memset(m, 0, sizeof *m);
    if (map != NULL) {
        plant_map_flux(map, 0.0, 0.0, &m->psi_nominal_Vs, &psi_q, NULL);
    }
    m->flux = model_of(m, p, map);
}

static int same_model(const flux_model_t *a, const flux_model_t *b)
{
    return a->ld_H == b->ld_H && a->lq_H == b->lq_H && a->slope == b->slope && a->cross == b->cross && a->q == b->q &&
           a->offset_Vs == b->offset_Vs && a->psi_f_Vs == b->psi_f_Vs;
}

/* (PL-8), (PL-28) */
static double iron_of(const plant_params_t *p, double w)
{
    const double length = sqrt(w * w + IRON_SIGN_RAD_S * IRON_SIGN_RAD_S);
    double per_flux = p->iron_k_h * w / length + p->iron_k_e * w;
    if (p->iron_k_excess != 0.0) {
        per_flux += p->iron_k_excess * w / sqrt(length);
    }
    return per_flux / 1.5;
}

void machine_update(machine_t *m, const plant_params_t *p, rotation_t rotor, double omega_e)
{
    m->pole_pairs = p->pole_pairs;
    m->r_ohm = p->r_ohm_20 * (1.0 + p->r_temp_coeff_per_K * (p->winding_C - 20.0));
    m->iron_A_per_Vs = iron_of(p, omega_e);
    const flux_model_t now = model_of(m, p, m->flux.map);
    if (same_model(&now, &m->flux)) {
        return;
    }
    m->flux = now;
    if (p->magnet_step_keeps_current) {
        set_flux_from_current(m, rotor);
    } else {
        search_current(m, (double[2]){m->im_dq[0], m->im_dq[1]});
    }
}

void machine_set_current(machine_t *m, const double im_dq[2], rotation_t rotor)
{
    m->im_dq[0] = im_dq[0];
    m->im_dq[1] = im_dq[1];
    set_flux_from_current(m, rotor);
}

void machine_predict(const machine_t *m, const double u_s[2], double h, rotation_t start, rotation_t end,
                     double i_dq[2])
{
    double i[2], i_s[2], psi[2], r[2], step[2];
    machine_current(m, i);
    to_stationary(start, i, i_s);
    for (int k = 0; k < 2; k++) {
        psi[k] = m->psi_s[k] + h * (u_s[k] - m->r_ohm * i_s[k]);
    }
    to_rotor(end, psi, psi);
    r[0] = psi[0] - m->psi_dq[0];
    r[1] = psi[1] - m->psi_dq[1];
    flux_solve_step(m->jac, m->per_det, r, step);
    i_dq[0] = m->im_dq[0] + step[0] - m->iron_A_per_Vs * psi[1];
    i_dq[1] = m->im_dq[1] + step[1] + m->iron_A_per_Vs * psi[0];
}

void machine_step(machine_t *m, const double u_s[2], const double i_mid_s[2], double h, rotation_t end)
{
    double r[2], start[2], before[2] = {m->psi_dq[0], m->psi_dq[1]};
    for (int k = 0; k < 2; k++) {
        m->psi_s[k] += h * (u_s[k] - m->r_ohm * i_mid_s[k]);
    }
    to_rotor(end, m->psi_s, m->psi_dq);
    r[0] = m->psi_dq[0] - before[0];
    r[1] = m->psi_dq[1] - before[1];
    flux_solve_step(m->jac, m->per_det, r, start);
    start[0] += m->im_dq[0];
    start[1] += m->im_dq[1];
    find_current(m, start);
}
