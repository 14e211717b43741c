/* SPDX-License-Identifier: Apache-2.0 */
#include "control/measure.h"

#include "fx/q.h"

static q15_t phase_current(const measure_config_t *config, uint16_t count, int phase)
{
    /* 17 bits * Q14 gain = Q30: both ends fit as long as the offset is a 16-bit count. */
    const int32_t raw = (int32_t)(((uint32_t)count << config->shift) & 0xFFFFU) - config->offset[phase];
    return fx_sat_q15((raw * config->gain_q14[phase] + 0x2000) >> 14);
}

measure_t measure_step(const measure_config_t *config, const adc_counts_t *counts)
{
    const uint32_t v_raw = ((uint32_t)counts->v_dc << config->shift) & 0xFFFFU;
    return (measure_t){
        .i = {phase_current(config, counts->i_a, 0), phase_current(config, counts->i_b, 1), phase_current(config, counts->i_c, 2)},
        /* 16-bit count * Q15 gain = 31 bits; a full count is one full scale, hence the extra bit. */
        .v_dc = fx_sat_q15((int32_t)((v_raw * config->v_dc_gain_q15 + 0x8000U) >> 16)),
    };
}
