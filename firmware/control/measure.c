/* SPDX-License-Identifier: Apache-2.0 */
#include "control/measure.h"

#include "fx/q.h"

static int32_t phase_current(const measure_config_t *config, uint32_t count, int phase)
{
    /* 16 bits * Q14 gain = Q30: both ends fit. Unsigned, so that a count beyond the converter's width wraps. */
    const uint32_t q29 = count * (uint32_t)config->scale[phase] + (uint32_t)config->bias[phase];
    return fx_sat_q15_word((int32_t)q29 >> 14);
}

measure_t measure_step(const measure_config_t *config, const adc_counts_t *counts)
{
    /* 16-bit count * Q15 gain = 31 bits; a full count is one full scale, hence the extra bit. */
    const uint32_t v_dc = (counts->v_dc * config->v_dc_scale + 0x8000U) >> 16;
    return (measure_t){
        .i = {phase_current(config, counts->i_a, 0), phase_current(config, counts->i_b, 1),
              phase_current(config, counts->i_c, 2)},
        .v_dc = fx_sat_q15_word((int32_t)v_dc),
    };
}
