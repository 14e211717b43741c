/* SPDX-License-Identifier: Apache-2.0 */
#include <stdbool.h>

#include "control/current/modulate_phases.h"
#include "control/current/transform.h"

#define THIRD Q15(1.0 / 3.0)
#define SQRT3_THIRD Q15(2.0 * SQRT3_HALF / 3.0)

/* Duty less the voltage error of the dead time. A phase that does not switch has no dead time (MO-9). */
static int32_t effective_duty(const modulate_config_t *config, uint32_t duty, int32_t sign)
{
    const bool switches = duty != 0U && duty != DUTY_ONE;
    return (int32_t)duty - (switches ? ((config->dead_time_q16 * sign + 0x8000) >> 16) : 0);
}

dq_q15_t modulate_applied(const modulate_config_t *config, const duty_t *duty, fx_pair_t i, fx_pair_t advanced,
                          int32_t v_dc)
{
    const abc_q15_t sign = polarity(config, i, advanced);
    const int32_t a = effective_duty(config, duty->a, sign.a);
    const int32_t b = effective_duty(config, duty->b, sign.b);
    const int32_t c = effective_duty(config, duty->c, sign.c);
    /* Clarke of the duties, in units of v_dc; |2a - b - c| <= 2^16 so that Q15 * Q15 stays below 2^31. */
    const ab_q15_t v = {transform_round((2 * a - b - c) * THIRD), transform_round((b - c) * SQRT3_THIRD)};
    return park((ab_q15_t){transform_round(v.alpha * v_dc), transform_round(v.beta * v_dc)}, advanced);
}
