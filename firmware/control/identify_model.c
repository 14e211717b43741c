/* SPDX-License-Identifier: Apache-2.0 */
#include "control/identify_model.h"

#include "fx/div.h"
#include "fx/vec.h"

#define H_MAX (1 << 28)

/* Q30 * Q30 = Q30, saturated. */
static int32_t mul_q30(int32_t a, int32_t b)
{
    return fx_sat_q31(((int64_t)a * b + (1 << 29)) >> 30);
}

/* l x with l in q15 of 2^l_shift and x in Q30: Q30. */
static int32_t induced(const identify_config_t *config, int32_t l, int32_t x)
{
    return fx_sat_q31(((int64_t)l * x) >> (15U - config->l_shift));
}

/* One standard deviation of a state in volts: sigma in q31, the derivative in Q30. */
static int32_t per_sigma(q31_t sigma, int32_t derivative)
{
    return fx_clamp_q31(fx_mul_q31(sigma, derivative), -H_MAX, H_MAX);
}

/* i/max(|i|, i_smooth), Q30 (ID-6). */
static int32_t direction(int32_t i_q15, q15_t magnitude)
{
    return (int32_t)fx_div_q15((q15_t)i_q15, magnitude) * 32768;
}

static void derivatives(const identify_config_t *config, const flux_point_t *flux, const identify_point_t *point,
                        identify_model_t *m)
{
    const int32_t a = point->iron / 2; /* Q30 */
    m->psi = (dq_t){flux->psi_d * 32768, flux->psi_q * 32768};
    m->i_m = (dq_t){point->i_m.d * 32768, point->i_m.q * 32768};
    m->slope = (flux->psi_d - flux->psi_f0) * 32768;
    m->iron_i = (dq_t){mul_q30(a, m->psi.q), -mul_q30(a, m->psi.d)};
    m->iron_psi = (dq_t){induced(config, flux->l_d, m->iron_i.d), induced(config, flux->l_qq, m->iron_i.q)};
    m->turn = (dq_t){fx_sub_q31(m->psi.q, induced(config, flux->l_d, m->i_m.q)),
                     fx_sub_q31(induced(config, flux->l_qq, m->i_m.d), m->psi.d)};
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
        [IDENTIFY_R] = per_sigma(sigma[IDENTIFY_R], point->i.d / 2),
        [IDENTIFY_DROP] = per_sigma(sigma[IDENTIFY_DROP], direction(i.d, length)),
        [IDENTIFY_LQ] = per_sigma(sigma[IDENTIFY_LQ], -mul_q30(w, m->psi.q)),
        [IDENTIFY_ANGLE] = per_sigma(sigma[IDENTIFY_ANGLE], -mul_q30(w, m->turn.q)),
        [IDENTIFY_IRON] = per_sigma(sigma[IDENTIFY_IRON], -mul_q30(w, m->iron_psi.q)),
    }};
    m->q = (identify_row_t){{
        [IDENTIFY_R] = per_sigma(sigma[IDENTIFY_R], point->i.q / 2),
        [IDENTIFY_DROP] = per_sigma(sigma[IDENTIFY_DROP], direction(i.q, length)),
        [IDENTIFY_FLUX] = per_sigma(sigma[IDENTIFY_FLUX], w),
        [IDENTIFY_LD] = per_sigma(sigma[IDENTIFY_LD], mul_q30(w, m->slope)),
        [IDENTIFY_ANGLE] = per_sigma(sigma[IDENTIFY_ANGLE], mul_q30(w, m->turn.d)),
        [IDENTIFY_IRON] = per_sigma(sigma[IDENTIFY_IRON], mul_q30(w, m->iron_psi.d)),
    }};
}

identify_model_t identify_model(const identify_config_t *config, const identify_point_t *point,
                                const flux_point_t *flux, q31_t r_prior)
{
    identify_model_t m = {.current = false};
    derivatives(config, flux, point, &m);
    rows(config, point, &m);
    const int32_t w = point->omega / 2;
    const int32_t d = fx_sub_q31(fx_add_q31(point->u.d, mul_q30(w, m.psi.q)), point->rate.d);
    const int32_t q = fx_sub_q31(fx_sub_q31(point->u.q, mul_q30(w, m.psi.d)), point->rate.q);
    m.y = (dq_t){fx_mulhi_sub(d, r_prior, point->i.d), fx_mulhi_sub(q, r_prior, point->i.q)};
    return m;
}

identify_row_t identify_torque_row(const identify_config_t *config, const identify_model_t *m)
{
    const q31_t *sigma = config->sigma;
    const int32_t iron = mul_q30(m->iron_psi.d, m->i_m.q) - mul_q30(m->iron_psi.q, m->i_m.d) +
                         mul_q30(m->psi.d, m->iron_i.q) - mul_q30(m->psi.q, m->iron_i.d);
    return (identify_row_t){{
        [IDENTIFY_FLUX] = per_sigma(sigma[IDENTIFY_FLUX], m->i_m.q),
        [IDENTIFY_LQ] = per_sigma(sigma[IDENTIFY_LQ], -mul_q30(m->psi.q, m->i_m.d)),
        [IDENTIFY_LD] = per_sigma(sigma[IDENTIFY_LD], mul_q30(m->slope, m->i_m.q)),
        [IDENTIFY_ANGLE] = per_sigma(sigma[IDENTIFY_ANGLE],
                                     mul_q30(m->turn.d, m->i_m.q) - mul_q30(m->turn.q, m->i_m.d)),
        [IDENTIFY_IRON] = per_sigma(sigma[IDENTIFY_IRON], iron),
    }};
}
