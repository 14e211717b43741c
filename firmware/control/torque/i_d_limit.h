/* SPDX-License-Identifier: Apache-2.0 */
#ifndef TORQUE_I_D_LIMIT_H
#define TORQUE_I_D_LIMIT_H
/** Demagnetisation limit of i_d at the magnets' temperature, which is estimated from their identified flux.
 *   t_psi = 20 C + dpsi/(psi_f alpha), at most t_assumed
 *   t = max(t_psi, winding), t_assumed without a winding temperature
 *   i_d_max = i_20 - slope (t - 20 C), at most i_max, at least 0
 * Source   docs/theory/limits.md (LM-8) ... (LM-10)
 * Units    currents and flux per unit, temperatures in tenths of a degree C
 * Range    every argument; i_20 and slope times 3277 K below 2^15 I_b
 * Rounding 1 LSB q15
 * Errors   none: the temperature used is never below the winding's and, where that is not measured, t_assumed
 * Context  1 kHz task; no division */
#include <stdint.h>

#include "fx/q.h"
#include "types/temperature.h"

typedef struct {
    int32_t i_20; /* Q15, at 20 C; a value above 1 acts only at higher temperature */
    q16_t slope;  /* per unit of current per tenth of a degree */
    q15_t i_max;
    q16_t dC_per_psi; /* 1/(psi_f alpha), <= 0 */
    int16_t assumed_dC;
} i_d_limit_config_t;

static inline q15_t i_d_limit_step(const i_d_limit_config_t *config, q15_t psi_d_error, int16_t winding_dC)
{
    int32_t dC = config->assumed_dC;
    if (temperature_is_known(winding_dC)) {
        const int32_t magnet = 200 + fx_mul_gain_q15(config->dC_per_psi, psi_d_error);
        dC = fx_max_s32(winding_dC, fx_min_s32(magnet, config->assumed_dC));
    }
    const int32_t reduction = fx_mulhi(config->slope, fx_sat_q15(dC - 200) * 65536);
    return (q15_t)fx_clamp_q31(config->i_20 - reduction, 0, config->i_max);
}

#endif
