/* SPDX-License-Identifier: Apache-2.0 */
#include "drive/turning_modulate.h"

#include "control/current/transform.h"
#include "fx/div.h"
#include "fx/q.h"

modulate_config_t turning_modulate(const modulate_config_t *given, int32_t knee_turns_q27, int32_t angle_step)
{
    modulate_config_t config = *given;
    const uint32_t turns = ((uint32_t)fx_abs_q31(angle_step) >> 22) | 1U;
    const int32_t knee_q17 = fx_quotient((uint32_t)knee_turns_q27, turns);
    if (knee_q17 < config.knee_q17) {
        config.knee_q17 = knee_q17;
        config.knee_side_q17 = fx_mul_q31(knee_q17, Q31(SQRT3_HALF));
    }
    return config;
}
