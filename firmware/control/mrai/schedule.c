/* SPDX-License-Identifier: Apache-2.0 */
#include "control/mrai/schedule.h"

#include "fx/codegen.h"
#include "fx/div.h"
#include "fx/q.h"
#include "fx/vec.h"

/* Share of psi_drift_full, which is the drift of an error of 5 %: below it the flux error is below 1 %. */
#define PSI_SETTLED Q15(0.2)

/* 2 k_psi/(omega_b w) in Q28 (MR-9): Q31 / Q15 = Q16, shifted up; saturates at the lowest speed. The
 * condition |w| >= omega_min excludes zero, and k_psi is not negative. */
static int32_t flux_step(const mrai_config_t *config, q15_t omega)
{
    return fx_shl_q31(config->flux_gain / omega, 12U);
}

/* 2 k_r/(omega_b n), n = 4 i_d^2 + i_q^2, in Q26 (MR-10): a 256th in Q31 over Q28 is a 32nd in Q31. */
static FX_NOT_INLINED int32_t resistance_step(const mrai_config_t *config, const operating_point_t *sample)
{
    const q15_t d = (q15_t)sample->i.d;
    const q15_t q = (q15_t)sample->i.q;
    const int32_t norm_q28 = fx_mul_q30(d, d) + (fx_mul_q30(q, q) >> 2);
    return fx_div_q31(config->resistance_gain / 256, norm_q28);
}

/* -omega_b T_s/sinc(w T_s/2) to second order (MR-5): the sampled flux is u/(w sinc), not u/w. */
static int32_t minus_voltage_q28(const mrai_config_t *config, q31_t omega)
{
    const q31_t more = fx_mul_q31(config->sinc_gain, fx_mul_q31(omega, omega));
    return -fx_shr_round(config->period, 3) - fx_shr_round(fx_mul_q31(config->period, more), 3);
}

/* |drift|/full, at most 1: share of the adaptation that is still to come (MR-18). */
static FX_NOT_INLINED q15_t drift_share(q31_t drift, q31_t full)
{
    return fx_q15_from_q31(fx_div_q31(fx_abs_q31(drift), full));
}

/* First-order filter towards 1 - drift while the parameter adapts, else towards 0 (MR-18). */
static q15_t quality_step(q15_t quality, q15_t rate, bool adapting, q15_t drift_share_now)
{
    const int32_t target = adapting ? Q15_MAX - drift_share_now : 0;
    return fx_add_q15(quality, fx_mul_q15(rate, fx_sat_q15_word(target - quality)));
}

mrai_schedule_t mrai_schedule_step(const mrai_config_t *config, mrai_quality_t *quality, const mrai_schedule_in_t *in)
{
    const q15_t omega = fx_q15_from_q31(in->sample->omega);
    const q15_t speed = fx_abs_q15(omega);
    const q15_t current = fx_magnitude(in->sample->i.d, in->sample->i.q);
    const mrai_state_t *identified = in->identifier;
    const bool adapt_flux = in->enabled && speed >= config->omega_min && current >= config->i_min;
    /* A flux error would drive the resistance to its limit, so it adapts only after the flux has settled. */
    const q15_t psi_drift = drift_share(fx_sub_q31(identified->psi_delta, quality->psi_last), config->psi_drift_full);
    const q15_t r_drift = drift_share(fx_sub_q31(identified->r_delta, quality->r_last), config->r_drift_full);
    const bool flux_settled = psi_drift <= PSI_SETTLED;
    const bool adapt_resistance = adapt_flux && flux_settled && speed <= config->omega_r_max;

    quality->psi_quality = quality_step(quality->psi_quality, config->quality_rate,
                                        adapt_flux && !mrai_flux_clamped(config, identified), psi_drift);
    quality->r_quality = quality_step(quality->r_quality, config->quality_rate,
                                      adapt_resistance && !mrai_resistance_clamped(config, identified), r_drift);
    quality->psi_last = identified->psi_delta;
    quality->r_last = identified->r_delta;

    const int32_t voltage = minus_voltage_q28(config, in->sample->omega);
    return (mrai_schedule_t){
        .flux_step_q28 = adapt_flux ? flux_step(config, omega) : 0,
        .resistance_step_q26 =
            adapt_resistance ? fx_min_s32(resistance_step(config, in->sample), resistance_step(config, in->next)) : 0,
        .minus_voltage_d_q28 = 2 * voltage,
        .minus_voltage_q28 = voltage,
    };
}
