/* SPDX-License-Identifier: Apache-2.0 */
#include "control/identify/point.h"

#include "control/identify/iron.h"
#include "fx/codegen.h"

/* Q15 * Q32 = Q47 -> Q31; |twice_sum| < 2^22. Not inlined, here and below: two calls take less memory than two
 * copies. */
static FX_NOT_INLINED q31_t mean(const identify_config_t *config, int32_t twice_sum)
{
    return fx_sat_q31(((int64_t)twice_sum * config->mean_gain_q32) >> 16);
}

/* 2 sum_{1..N} - last + first: the trapezoidal mean. */
static q31_t trapezoid(const identify_config_t *config, int32_t sum, int32_t first, int32_t last)
{
    return mean(config, 2 * sum - last + first);
}

/* The N periods begin with samples 0 ... N - 1, which hold their voltages. Q30, divided by sinc (MR-5). */
static int32_t acting_voltage(const identify_config_t *config, int32_t sum, int32_t first, int32_t last, q31_t sinc)
{
    const q31_t u = mean(config, 2 * (sum - last + first));
    return fx_mulhi_add(u >> 1, u, sinc);
}

/* d psi/dt over the window, Q30; (ID-3) takes it with w T_s/2 cot(w T_s/2). */
static FX_NOT_INLINED int32_t flux_rate(const identify_config_t *config, int32_t first, int32_t last, q31_t sinc)
{
    /* Q15 * Q28 = Q43, limited to 1 pu. */
    const q31_t rate = fx_sat_q31(((int64_t)(last - first) * config->rate_gain_q28) >> 12);
    return fx_mulhi_sub(rate >> 1, rate, 2 * sinc);
}

/* The tracked speed lags during acceleration and serves only to count whole turns (ID-2). */
static q31_t mean_speed(const identify_config_t *config, uint32_t angle_change, q31_t tracked)
{
    const uint32_t expected = (uint32_t)(((int64_t)tracked * config->window_turns_q29) >> 28);
    return fx_add_q31(tracked, fx_mul_gain_q31(config->turn_to_pu, (int32_t)(angle_change - expected)));
}

identify_point_t identify_point(const identify_config_t *config, const identify_window_t *window, q31_t omega_tracked)
{
    const identify_end_t *a = &window->first;
    const identify_end_t *b = &window->last;
    const q31_t omega = mean_speed(config, b->theta - a->theta, omega_tracked);
    const q31_t sinc = fx_mulhi(2 * config->sinc_gain, fx_mul_q31(omega, omega));
    const q31_t iron = identify_iron_admittance(config, omega);
    const dq_q31_t i = {trapezoid(config, window->sum_i.d, a->i.d, b->i.d),
                        trapezoid(config, window->sum_i.q, a->i.q, b->i.q)};
    const q15_t speed = fx_abs_q15(fx_q15_from_q31(omega));
    return (identify_point_t){
        .i = i,
        .u = {acting_voltage(config, window->sum_u.d, a->u.d, b->u.d, sinc),
              acting_voltage(config, window->sum_u.q, a->u.q, b->u.q, sinc)},
        .rate = {flux_rate(config, a->psi.d, b->psi.d, sinc), flux_rate(config, a->psi.q, b->psi.q, sinc)},
        .i_m = {fx_q15_from_q31(fx_add_q31(i.d, fx_mul_q31(iron, (a->psi.q + b->psi.q) * 32768))),
                fx_q15_from_q31(fx_sub_q31(i.q, fx_mul_q31(iron, (a->psi.d + b->psi.d) * 32768)))},
        .omega = omega,
        .iron = iron,
        .chord_q30 = sinc, /* theta^2/24 in Q31 */
        .limited = window->limited,
        .valid = window->acting && speed >= config->omega_min,
    };
}
