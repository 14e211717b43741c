/* SPDX-License-Identifier: Apache-2.0 */
#include "control/identify_model.h"

#include "control/identify_q30.h"
#include "fx/div.h"
#include "fx/vec.h"

/* l x with l in q15 of 2^l_shift and x in Q30: Q30. */
static int32_t induced(const identify_config_t *config, int32_t l, int32_t x)
{
    return fx_shl_q31(fx_mulhi(l * 65536, x), 1U + config->l_shift); /* Q31 * Q30 = Q29 */
}

/* i/max(|i|, i_smooth), Q30 (ID-6). */
static int32_t direction(int32_t i_q15, q15_t magnitude)
{
    return (int32_t)fx_div_q15((q15_t)i_q15, magnitude) * 32768;
}

static void derivatives(const identify_config_t *config, const flux_point_t *flux, const flux_inductances_t *l,
                        const identify_point_t *point, identify_model_t *m)
{
    const int32_t a = point->iron / 2; /* Q30 */
    m->psi = (dq_t){flux->psi_d * 32768, flux->psi_q * 32768};
    m->i_m = (dq_t){point->i_m.d * 32768, point->i_m.q * 32768};
    m->slope = (flux->psi_d - flux->psi_f0) * 32768;
    m->iron_i = (dq_t){identify_mul(a, m->psi.q), -identify_mul(a, m->psi.d)};
    m->iron_psi = (dq_t){induced(config, l->l_d, m->iron_i.d), induced(config, l->l_qq, m->iron_i.q)};
    m->turn = (dq_t){fx_sub_q31(m->psi.q, induced(config, l->l_d, m->i_m.q)),
                     fx_sub_q31(induced(config, l->l_qq, m->i_m.d), m->psi.d)};
}

static void rows(const identify_config_t *config, const identify_point_t *point, identify_model_t *m)
{
    const q31_t *sigma = config->sigma;
    const int32_t w = point->omega / 2; /* Q30 */
    const dq_t i = {fx_q15_from_q31(point->i.d), fx_q15_from_q31(point->i.q)};
    const q15_t magnitude = fx_magnitude((q15_t)i.d, (q15_t)i.q);
    const q15_t length = (q15_t)fx_max_s32(magnitude, config->i_smooth);
    m->current = magnitude >= config->i_min;
    m->d = (identify_row_t){{
        [IDENTIFY_R] = identify_sigma(sigma[IDENTIFY_R], point->i.d / 2),
        [IDENTIFY_DROP] = identify_sigma(sigma[IDENTIFY_DROP], direction(i.d, length)),
        [IDENTIFY_LQ] = identify_sigma(sigma[IDENTIFY_LQ], -identify_mul(w, m->psi.q)),
        [IDENTIFY_ANGLE] = identify_sigma(sigma[IDENTIFY_ANGLE], -identify_mul(w, m->turn.q)),
        [IDENTIFY_IRON] = identify_sigma(sigma[IDENTIFY_IRON], -identify_mul(w, m->iron_psi.q)),
    }};
    m->q = (identify_row_t){{
        [IDENTIFY_R] = identify_sigma(sigma[IDENTIFY_R], point->i.q / 2),
        [IDENTIFY_DROP] = identify_sigma(sigma[IDENTIFY_DROP], direction(i.q, length)),
        [IDENTIFY_FLUX] = identify_sigma(sigma[IDENTIFY_FLUX], w),
        [IDENTIFY_LD] = identify_sigma(sigma[IDENTIFY_LD], identify_mul(w, m->slope)),
        [IDENTIFY_ANGLE] = identify_sigma(sigma[IDENTIFY_ANGLE], identify_mul(w, m->turn.d)),
        [IDENTIFY_IRON] = identify_sigma(sigma[IDENTIFY_IRON], identify_mul(w, m->iron_psi.d)),
    }};
}

identify_model_t identify_model(const identify_config_t *config, const identify_point_t *point,
                                const flux_point_t *flux, const flux_inductances_t *l, q31_t r_prior)
{
    identify_model_t m = {.current = false};
    derivatives(config, flux, l, point, &m);
    rows(config, point, &m);
    const int32_t w = point->omega / 2;
    const int32_t d = fx_sub_q31(fx_add_q31(point->u.d, identify_mul(w, m.psi.q)), point->rate.d);
    const int32_t q = fx_sub_q31(fx_sub_q31(point->u.q, identify_mul(w, m.psi.d)), point->rate.q);
    m.y = (dq_t){fx_mulhi_sub(d, r_prior, point->i.d), fx_mulhi_sub(q, r_prior, point->i.q)};
    return m;
}

identify_row_t identify_torque_row(const identify_config_t *config, const identify_model_t *m)
{
    const q31_t *sigma = config->sigma;
    const int32_t iron = identify_mul(m->iron_psi.d, m->i_m.q) - identify_mul(m->iron_psi.q, m->i_m.d) +
                         identify_mul(m->psi.d, m->iron_i.q) - identify_mul(m->psi.q, m->iron_i.d);
    return (identify_row_t){{
        [IDENTIFY_FLUX] = identify_sigma(sigma[IDENTIFY_FLUX], m->i_m.q),
        [IDENTIFY_LQ] = identify_sigma(sigma[IDENTIFY_LQ], -identify_mul(m->psi.q, m->i_m.d)),
        [IDENTIFY_LD] = identify_sigma(sigma[IDENTIFY_LD], identify_mul(m->slope, m->i_m.q)),
        [IDENTIFY_ANGLE] = identify_sigma(sigma[IDENTIFY_ANGLE],
                                          identify_mul(m->turn.d, m->i_m.q) - identify_mul(m->turn.q, m->i_m.d)),
        [IDENTIFY_IRON] = identify_sigma(sigma[IDENTIFY_IRON], iron),
    }};
}
