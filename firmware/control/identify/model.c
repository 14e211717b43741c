/* SPDX-License-Identifier: Apache-2.0 */
#include "control/identify/model.h"

#include "control/identify/q30.h"
#include "fx/div.h"
#include "fx/vec.h"

/* l x with l in q15 of 2^l_shift and x in Q30: Q30. */
static int32_t flux_of_current(const identify_config_t *config, int32_t l, int32_t x)
{
    return fx_shl_q31(fx_mulhi(l * 65536, x), 1U + config->l_shift); /* Q31 * Q30 = Q29 */
}

/* i/max(|i|, i_smooth), Q30 (ID-6). */
static int32_t direction(int32_t i_q15, int32_t magnitude)
{
    return fx_div_q15(i_q15, magnitude) * 32768;
}

static void flux_derivatives(const identify_config_t *config, const identify_tables_t *tables,
                             const identify_point_t *point, identify_model_t *m)
{
    const flux_point_t *flux = &tables->flux;
    const flux_inductances_t *l = &tables->inductances;
    const int32_t a = point->iron >> 1; /* Q30 */
    m->psi = (dq_q30_t){flux->psi_d * 32768, flux->psi_q * 32768};
    m->i_m = (dq_q30_t){point->i_m.d * 32768, point->i_m.q * 32768};
    m->iron_i = (dq_q30_t){identify_mul(a, m->psi.q), -identify_mul(a, m->psi.d)};
    m->psi_q.h_q30[IDENTIFY_LQ] = m->psi.q;
    m->psi_d.h_q30[IDENTIFY_LD] = (flux->psi_d - flux->psi_f0) * 32768;
    m->psi_d.h_q30[IDENTIFY_ANGLE] = fx_sub_q31(m->psi.q, flux_of_current(config, l->l_d, m->i_m.q));
    m->psi_q.h_q30[IDENTIFY_ANGLE] = fx_sub_q31(flux_of_current(config, l->l_qq, m->i_m.d), m->psi.d);
    m->psi_d.h_q30[IDENTIFY_IRON] = flux_of_current(config, l->l_d, m->iron_i.d);
    m->psi_q.h_q30[IDENTIFY_IRON] = flux_of_current(config, l->l_qq, m->iron_i.q);
}

/* Derivatives by the states to flux_derivatives by their sigmas. */
static void per_sigma(const identify_config_t *config, jacobian_row_t *row)
{
    for (unsigned j = 0; j < IDENTIFY_STATES; j++) {
        row->h_q30[j] = identify_sigma(config->sigma[j], row->h_q30[j]);
    }
}

static void jacobian_rows(const identify_config_t *config, const identify_point_t *point, q31_t r_prior,
                          identify_model_t *m)
{
    const int32_t w = point->omega >> 1; /* Q30 */
    const dq_q15_t i = {fx_q15_from_q31(point->i.d), fx_q15_from_q31(point->i.q)};
    const int32_t magnitude = fx_magnitude(i.d, i.q);
    const int32_t length = fx_max_s32(magnitude, config->i_smooth);
    for (unsigned j = IDENTIFY_FIRST_OF_FLUX; j < IDENTIFY_STATES; j++) {
        m->now.d.h_q30[j] = -identify_mul(w, m->psi_q.h_q30[j]);
        m->now.q.h_q30[j] = identify_mul(w, m->psi_d.h_q30[j]);
    }
    const int32_t d = fx_sub_q31(fx_sub_q31(point->u.d, m->now.d.h_q30[IDENTIFY_LQ]), point->rate.d);
    const int32_t q = fx_sub_q31(fx_sub_q31(point->u.q, identify_mul(w, m->psi.d)), point->rate.q);
    m->now.e = (dq_q30_t){fx_mulhi_sub(d, r_prior, point->i.d), fx_mulhi_sub(q, r_prior, point->i.q)};
    m->current = magnitude >= config->i_min;
    m->now.d.h_q30[IDENTIFY_R] = point->i.d >> 1;
    m->now.d.h_q30[IDENTIFY_DROP] = direction(i.d, length);
    m->now.q.h_q30[IDENTIFY_R] = point->i.q >> 1;
    m->now.q.h_q30[IDENTIFY_DROP] = direction(i.q, length);
    m->now.q.h_q30[IDENTIFY_FLUX] = w;
    per_sigma(config, &m->now.d);
    per_sigma(config, &m->now.q);
}

/* What is read without being written below: clearing the whole model would write 38 words in place of four. */
static void clear_constants(identify_model_t *m)
{
    m->psi_d.h_q30[IDENTIFY_FLUX] = 0;
    m->psi_q.h_q30[IDENTIFY_FLUX] = 0;
    m->psi_d.h_q30[IDENTIFY_LQ] = 0;
    m->psi_q.h_q30[IDENTIFY_LD] = 0;
}

void identify_model(const identify_config_t *config, const identify_point_t *point, const identify_tables_t *tables,
                    q31_t r_prior, identify_model_t *model)
{
    clear_constants(model);
    flux_derivatives(config, tables, point, model);
    jacobian_rows(config, point, r_prior, model);
}

void identify_torque_row(const identify_config_t *config, const identify_model_t *m, jacobian_row_t *row)
{
    row->h_q30[IDENTIFY_R] = 0;
    row->h_q30[IDENTIFY_DROP] = 0;
    for (unsigned j = IDENTIFY_FIRST_OF_FLUX; j < IDENTIFY_STATES; j++) {
        row->h_q30[j] = identify_mul(m->psi_d.h_q30[j], m->i_m.q) - identify_mul(m->psi_q.h_q30[j], m->i_m.d);
    }
    row->h_q30[IDENTIFY_FLUX] = m->i_m.q;
    row->h_q30[IDENTIFY_IRON] += identify_mul(m->psi.d, m->iron_i.q) - identify_mul(m->psi.q, m->iron_i.d);
    per_sigma(config, row);
}

int32_t identify_mean_torque(const identify_config_t *config, const flux_inductances_t *l, int32_t chord,
                             const identify_flux_t *at)
{
    const int32_t torque_at_ends = fx_sub_q31(identify_mul(at->psi.d, at->i_m.q), identify_mul(at->psi.q, at->i_m.d));
    /* Q30/Q15 = Q15, with l in q15 of 2^l_shift; no table has an l below 1. */
    const int32_t product = identify_mul(identify_mul(chord, at->psi.d), at->psi.q);
    const int32_t salient_part = fx_sub_q31(product / fx_max_s32(l->l_qq, 1), product / fx_max_s32(l->l_d, 1));
    return fx_sub_q31(torque_at_ends,
                      fx_add_q31(identify_mul(chord, torque_at_ends), fx_shl_q31(salient_part, 15U - config->l_shift)));
}
