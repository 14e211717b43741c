/* SPDX-License-Identifier: Apache-2.0 */
#include "control/current/measure.h"

#include "control/current/transform.h"

#include "fx/q.h"

#define ROOT_THREE_Q19 908094
#define QUARTER_LSB_Q28 2048 /* of q15 */

measure_t measure_step(const measure_config_t *config, const adc_counts_t *counts)
{
    /* A third of each phase in Q28 is below 4/3, so that 2a + b + c fits; only a count beyond the converter's width
     * wraps. */
    const int32_t a = measure_line(&config->phase[0], counts->i_a);
    const int32_t minus_b = measure_line(&config->phase[1], counts->i_b);
    const int32_t minus_c = measure_line(&config->phase[2], counts->i_c);
    const int32_t minus_others = fx_add_wrap(minus_b, minus_c);
    return (measure_t){
        .i = {fx_sat_q15_word((int32_t)((uint32_t)minus_others + 2U * (uint32_t)a) >> 13),
              fx_sat_q15_word(fx_mulhi(fx_sub_wrap(minus_c, minus_b), ROOT_THREE_Q19))}, /* Q28 * Q19 = Q15 */
        .zero_q28 = fx_sub_wrap(a, minus_others),
        .v_dc = measure_v_dc(&config->v_dc, counts->v_dc),
    };
}

abc_q15_t measure_phases(fx_pair_t i_ab, int32_t zero_q28)
{
    const ab_q15_t i = {(int16_t)(i_ab & 0xFFFFU), (int16_t)(i_ab >> 16)};
    const int32_t zero = fx_add_wrap(zero_q28, QUARTER_LSB_Q28) >> 13; /* rounds with the quarter LSB of phase a */
    const abc_t x = inverse_clarke(i.alpha, fx_mulhi(i.beta * 65536, Q16(SQRT3_HALF))); /* Q31 * Q16 = Q15 */
    return (abc_q15_t){fx_sat_q15_word(x.a + zero), fx_sat_q15_word(x.b + zero), fx_sat_q15_word(x.c + zero)};
}
