/* SPDX-License-Identifier: Apache-2.0 */
#include "control/current/modulate_phases.h"
#include "fx/codegen.h"
#include "fx/q.h"

/* Half a duty, and half an LSB to round it. */
#define HALF_Q31 0x40000000
#define ROUND_Q31 0x8000

/* Phase voltages without zero sequence, in units of v_dc: Q31 * Q30 = Q29 (MO-2). */
static abc_q29_t phases(const modulate_config_t *config, fx_pair_t v, fx_pair_t at)
{
    int32_t alpha_q31 = config->alpha_q31;
    int32_t side_q31 = config->side_q31;
    fx_both_loaded(&alpha_q31, &side_q31);
    const int32_t alpha_q29 = fx_mulhi(alpha_q31, fx_difference2(v, at));
    const abc_t x = inverse_clarke(alpha_q29, fx_mulhi(side_q31, fx_dot2_cross(v, at)));
    return (abc_q29_t){x.a, x.b, x.c};
}

/* Kept in a register, or else the compiler would join these branches with the others, which costs 0.8 instructions on
 * average. */
static inline FX_INLINED int32_t plus_twice(int32_t level, int32_t x)
{
    return fx_in_register(level + 2 * x);
}

/* level plus twice the middle one of the three phase voltages. As they sum to zero, it is minus the sum of the largest
 * and the smallest: half of it, added to all phases, is the zero sequence (MO-4). It is added in each branch, because
 * the compiler would keep it in a further register otherwise, which costs an instruction. */
static int32_t plus_middle(int32_t level, abc_q29_t x)
{
    if (x.a < x.b) {
        if (x.b < x.c) {
            return plus_twice(level, x.b);
        }
        return (x.a < x.c) ? level + 2 * x.c : level + 2 * x.a;
    }
    if (x.a < x.c) {
        return plus_twice(level, x.a);
    }
    return (x.b < x.c) ? level + 2 * x.c : level + 2 * x.b;
}

/* Distance of a phase's duty from one half, Q31. May wrap; adding half a duty then wraps it back. */
static int32_t phase_q31(int32_t common_q31, int32_t x_q29, int32_t dead_time_q16, int32_t sign)
{
    const int32_t level = fx_in_register((int32_t)((uint32_t)common_q31 + 4U * (uint32_t)x_q29));
    return (int32_t)((uint32_t)level + (uint32_t)(dead_time_q16 * sign));
}

/* Q31, distances from one half; middle: half a duty and half an LSB to round it. */
typedef struct {
    int32_t longest, nearer_rail, middle;
} pulse_limits_t;

/* A pulse or a gap shorter than the bridge can make becomes either none or the shortest one, whichever is nearer
 * (MO-8). The magnitude of a negative number is taken as its ones' complement, which is one LSB of Q31 too small; the
 * rounding of the duty removes the difference. */
static uint32_t limit_pulse(pulse_limits_t limits, int32_t x_q31, uint32_t *limited)
{
    const int32_t distance = fx_ones_magnitude(x_q31);
    int32_t made_q31 = x_q31;
    if (distance >= limits.longest) {
        const int32_t possible = fx_in_register((distance < limits.nearer_rail) ? limits.longest : HALF_Q31);
        *limited = (uint32_t)possible; /* not zero, without another instruction */
        made_q31 = possible ^ (fx_in_register(x_q31) >> 31);
    }
    return ((uint32_t)made_q31 + (uint32_t)limits.middle) >> 16;
}

modulate_out_t modulate_step(const modulate_config_t *config, fx_pair_t v, fx_pair_t i, fx_pair_t advanced)
{
    const abc_q29_t x = phases(config, v, advanced);
    const abc_q15_t sign = polarity(config, i, advanced);
    const int32_t shift = plus_middle(0, x);
    const int32_t dead_time = config->dead_time_q16;
    const pulse_limits_t limits = {config->longest_q31, config->nearer_rail_q31, fx_in_register(HALF_Q31 + ROUND_Q31)};
    uint32_t limited = 0;
    const uint32_t a = limit_pulse(limits, phase_q31(shift, x.a, dead_time, sign.a), &limited);
    const uint32_t b = limit_pulse(limits, phase_q31(shift, x.b, dead_time, sign.b), &limited);
    const uint32_t c = limit_pulse(limits, phase_q31(shift, x.c, dead_time, sign.c), &limited);
    return (modulate_out_t){{a, b, c}, limited};
}

duty_t modulate_clear(const modulate_config_t *config, fx_pair_t v, fx_pair_t i, fx_pair_t advanced)
{
    const abc_q29_t x = phases(config, v, advanced);
    const abc_q15_t sign = polarity(config, i, advanced);
    const int32_t common = plus_middle(fx_in_register(HALF_Q31 + ROUND_Q31), x);
    const int32_t dead_time = config->dead_time_q16;
    return (duty_t){(uint32_t)phase_q31(common, x.a, dead_time, sign.a) >> 16,
                    (uint32_t)phase_q31(common, x.b, dead_time, sign.b) >> 16,
                    (uint32_t)phase_q31(common, x.c, dead_time, sign.c) >> 16};
}
