/* SPDX-License-Identifier: Apache-2.0 */
#include "control/modulate_phases.h"
#include "fx/q.h"

/* Half a duty, and half an LSB to round it. */
#define HALF_Q31 0x40000000
#define ROUND_Q31 0x8000

/* The phases without their zero sequence, in units of v_dc: Q31 * Q30 = Q29 (MO-2). */
static phases_t phases(const modulate_config_t *config, fx_pair_t v, fx_pair_t at)
{
    int32_t alpha_q31 = config->alpha_q31;
    int32_t side_q31 = config->side_q31;
    fx_arch_together(&alpha_q31, &side_q31);
    const int32_t a = fx_mulhi(alpha_q31, fx_difference2(v, at));
    const int32_t side = fx_mulhi(side_q31, fx_dot2_cross(v, at));
    const int32_t b = side - (a >> 1);
    return (phases_t){a, b, b - 2 * side};
}

/* The middle one of three phases: as they sum to zero, minus the sum of the outer two. */
static int32_t middle(phases_t x)
{
    if (x.a < x.b) {
        return (x.b < x.c) ? x.b : fx_max_s32(x.a, x.c);
    }
    return (x.a < x.c) ? x.a : fx_max_s32(x.b, x.c);
}

/* What a phase's duty is beyond the middle, Q31: wraps only where a caller's half of a duty on top wraps it back. */
static int32_t phase_q31(int32_t common_q31, int32_t x_q29, int32_t dead_time_q16, int32_t sign)
{
    const int32_t level = fx_arch_opaque((int32_t)((uint32_t)common_q31 + (uint32_t)(dead_time_q16 * sign)));
    return (int32_t)((uint32_t)level + 4U * (uint32_t)x_q29);
}

/* What the bridge can make nearest to a rail. */
typedef struct {
    int32_t longest, nearer_rail, middle; /* Q31; the latter with half an LSB to round a duty */
} reach_t;

/* A pulse or a gap shorter than the bridge can make becomes the nearer of nothing and the shortest (MO-8). Of a
 * negative number the ones' complement is one short of the magnitude: rounding the duty makes up for it. */
static uint32_t realisable(reach_t reach, int32_t x_q31, uint32_t *limited)
{
    const int32_t far = x_q31 ^ (x_q31 >> 31);
    if (far < reach.longest) {
        return ((uint32_t)x_q31 + (uint32_t)reach.middle) >> 16;
    }
    *limited = 1U;
    const int32_t made = (far < reach.nearer_rail) ? reach.longest : HALF_Q31;
    return ((uint32_t)(made ^ (fx_arch_opaque(x_q31) >> 31)) + (uint32_t)reach.middle) >> 16;
}

modulate_out_t modulate_step(const modulate_config_t *config, fx_pair_t v, fx_pair_t i, fx_pair_t advanced)
{
    const phases_t x = phases(config, v, advanced);
    const phases_t sign = polarity(config, i, advanced);
    const int32_t shift = 2 * middle(x);
    const int32_t dead_time = config->dead_time_q16;
    const fx_arch_two_t limits = fx_arch_load_two(&config->longest_q31); /* and nearer_rail_q31 */
    const reach_t reach = {limits.first, limits.second, fx_arch_opaque(HALF_Q31 + ROUND_Q31)};
    uint32_t limited = 0;
    const uint32_t a = realisable(reach, phase_q31(shift, x.a, dead_time, sign.a), &limited);
    const uint32_t b = realisable(reach, phase_q31(shift, x.b, dead_time, sign.b), &limited);
    const uint32_t c = realisable(reach, phase_q31(shift, x.c, dead_time, sign.c), &limited);
    return (modulate_out_t){{a, b, c}, limited};
}

duty_t modulate_clear(const modulate_config_t *config, fx_pair_t v, fx_pair_t i, fx_pair_t advanced)
{
    const phases_t x = phases(config, v, advanced);
    const phases_t sign = polarity(config, i, advanced);
    const int32_t common = fx_arch_opaque(HALF_Q31 + ROUND_Q31) + 2 * middle(x);
    const int32_t dead_time = config->dead_time_q16;
    return (duty_t){(uint32_t)phase_q31(common, x.a, dead_time, sign.a) >> 16,
                    (uint32_t)phase_q31(common, x.b, dead_time, sign.b) >> 16,
                    (uint32_t)phase_q31(common, x.c, dead_time, sign.c) >> 16};
}
