/* SPDX-License-Identifier: Apache-2.0 */
#include "control/measure.h"

#include "fx/q.h"

/* Q27 to q15 in one product: 2^20 times the factor of the transform. */
#define PER_THREE 349525      /* 2^20/3 */
#define PER_ROOT_THREE 605396 /* 2^20/sqrt(3) */

static int32_t phase_q27(const measure_config_t *config, uint32_t count, int phase)
{
    /* 16 bits * gain below 2 in Q12, twice for both signs: 30 bits. Unsigned, so that a count beyond the converter's
     * width wraps. */
    return (int32_t)(count * (uint32_t)config->phase[phase].scale + (uint32_t)config->phase[phase].bias);
}

measure_t measure_step(const measure_config_t *config, const adc_counts_t *counts)
{
    const int32_t a = phase_q27(config, counts->i_a, 0);
    const int32_t b = phase_q27(config, counts->i_b, 1);
    const int32_t c = phase_q27(config, counts->i_c, 2);
    const int32_t others = fx_add_q31(b, c);
    /* 16-bit count * gain in Q14 = 31 bits; a full count is one full scale, hence the extra bit. */
    const uint32_t v_dc = counts->v_dc * config->v_dc_scale + 0x4000U;
    return (measure_t){
        .i = {fx_sat_q15_word(fx_mulhi(fx_sub2_q31(others, a), -PER_THREE)),
              fx_sat_q15_word(fx_mulhi(fx_sub_q31(b, c), PER_ROOT_THREE))},
        .sum_q27 = fx_add_q31(others, a),
        .v_dc = fx_usat_q15_word((int32_t)v_dc >> 15),
    };
}

abc_t measure_phases(fx_pair_t i_ab, int32_t sum_q27)
{
    const ab_t i = {(int16_t)(i_ab & 0xFFFFU), (int16_t)(i_ab >> 16)};
    const int32_t zero = fx_mulhi(sum_q27, PER_THREE);
    const int32_t side = fx_mulhi(i.beta * 65536, Q16(0.86602540378443865)); /* Q31 * Q16 = Q15 */
    const int32_t half = i.alpha >> 1;
    return (abc_t){fx_sat_q15_word(i.alpha + zero), fx_sat_q15_word(zero - half + side),
                   fx_sat_q15_word(zero - half - side)};
}
