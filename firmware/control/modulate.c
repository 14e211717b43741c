/* SPDX-License-Identifier: Apache-2.0 */
#include "control/modulate_phases.h"
#include "control/transform.h"
#include "fx/q.h"

#define DUTY_HALF 16384
/* The largest distance of a phase from the middle, one count below the full range in all. */
#define HALF_MAX_Q31 (32766 << 15)
/* Half a duty, and half an LSB to round it. */
#define MIDDLE_Q31 0x40008000U

/* Stator voltage in units of v_dc. Q17 * Q30 = Q15. */
static ab_t normalise(fx_pair_t u, fx_pair_t at, int32_t v_dc)
{
    const int32_t per_v_dc = (int32_t)(UINT32_MAX / (uint32_t)v_dc);
    return (ab_t){fx_mulhi(per_v_dc, fx_difference2(u, at)), fx_mulhi(per_v_dc, fx_dot2_cross(u, at))};
}

/* The middle one of three phases: as they sum to zero, minus the sum of the outer two. */
static int32_t middle(phases_t x)
{
    if (x.a < x.b) {
        return (x.b < x.c) ? x.b : fx_max_s32(x.a, x.c);
    }
    return (x.a < x.c) ? x.a : fx_max_s32(x.b, x.c);
}

/* Pulses and gaps shorter than the bridge can make snap to the nearer of nothing and the shortest (MO-8). */
static uint32_t snapped(int32_t duty, int32_t min_pulse)
{
    const bool upper = duty > DUTY_HALF;
    const int32_t pulse = upper ? DUTY_ONE - duty : duty;
    const int32_t made = (2 * pulse < min_pulse) ? 0 : min_pulse;
    return (uint32_t)(upper ? DUTY_ONE - made : made);
}

/* One comparison for a duty that stays; one that does not leaves a bit in *changed. */
static uint32_t realisable(int32_t duty, int32_t min_pulse, uint32_t *changed)
{
    if (__builtin_expect((uint32_t)(duty - min_pulse) <= (uint32_t)(DUTY_ONE - 2 * min_pulse), 1)) {
        return (uint32_t)duty;
    }
    const uint32_t made = snapped(duty, min_pulse);
    *changed |= made ^ (uint32_t)duty;
    return made;
}

static duty_t all_realisable(const modulate_config_t *config, phases_t want, uint32_t *changed)
{
    const int32_t min_pulse = config->min_pulse;
    return (duty_t){realisable(want.a, min_pulse, changed), realisable(want.b, min_pulse, changed),
                    realisable(want.c, min_pulse, changed)};
}

/* |u|^2 < v_dc^2/2, so that the phases fit Q31, and a dc voltage to divide by. */
static bool fits_q31(const modulate_config_t *config, fx_pair_t u, int32_t v_dc)
{
    return v_dc >= config->v_dc_min && (uint32_t)fx_dot2(u, u) < (uint32_t)(v_dc * v_dc) >> 1;
}

/* Min-max zero sequence: both ends equally far from the rails. Duties without dead time, Q31 and half an LSB to round
 * them (MO-4): |v| < 0.71, the phases fit Q31; unsigned, as only the sums need to be in range. */
static phases_t centred_q31(ab_t v)
{
    const int32_t side = fx_arch_opaque(v.beta * Q16(0.86602540378443865)); /* Q15 * Q16 = Q31 */
    const int32_t b = side - v.alpha * DUTY_ONE;
    const phases_t x = {v.alpha * (2 * DUTY_ONE), b, (int32_t)((uint32_t)b - 2U * (uint32_t)side)};
    const uint32_t shift = (uint32_t)fx_arch_opaque((int32_t)MIDDLE_Q31) + (uint32_t)(middle(x) >> 1);
    return (phases_t){(int32_t)((uint32_t)x.a + shift), (int32_t)((uint32_t)x.b + shift),
                      (int32_t)((uint32_t)x.c + shift)};
}

static uint32_t duty_of(int32_t y, int32_t dead_time_q16, int32_t sign)
{
    return ((uint32_t)y + (uint32_t)(dead_time_q16 * sign)) >> 16;
}

static duty_t plain(const modulate_config_t *config, phases_t y, phases_t sign)
{
    const int32_t dead_time = 2 * config->dead_time;
    return (duty_t){duty_of(y.a, dead_time, sign.a), duty_of(y.b, dead_time, sign.b), duty_of(y.c, dead_time, sign.c)};
}

/* From the middle to a duty, Q31, half an LSB of rounding included. */
static phases_t off_middle(phases_t y)
{
    return (phases_t){(int32_t)((uint32_t)y.a - 0x40000000U), (int32_t)((uint32_t)y.b - 0x40000000U),
                      (int32_t)((uint32_t)y.c - 0x40000000U)};
}

static int32_t farthest(phases_t x)
{
    return fx_max_s32(x.a, fx_max_s32(x.b, x.c));
}

static int32_t scaled(int32_t x, int32_t by_q30)
{
    return 4 * fx_mulhi(x, by_q30);
}

/* x times 2^halvings (0 or 1), shortened about the middle if the hexagon is smaller (MO-3), with pulses that the bridge
 * can make. */
static modulate_out_t near_the_hexagon(const modulate_config_t *config, phases_t x, int32_t halvings, phases_t sign)
{
    const int32_t half = farthest(x);
    const bool beyond = half > (HALF_MAX_Q31 >> halvings);
    int32_t by = (halvings == 0) ? 1 << 30 : INT32_MAX; /* Q30 */
    if (beyond) { /* at most 2^halvings */
        by = (int32_t)((4U * (uint32_t)HALF_MAX_Q31) / (((uint32_t)half + 0x3FFFU) >> 14)) * 16384;
    }
    const int32_t dead_time = 2 * config->dead_time;
    const phases_t want = {DUTY_HALF + ((scaled(x.a, by) + dead_time * sign.a) >> 16),
                           DUTY_HALF + ((scaled(x.b, by) + dead_time * sign.b) >> 16),
                           DUTY_HALF + ((scaled(x.c, by) + dead_time * sign.c) >> 16)};
    uint32_t changed = beyond ? 1U : 0U;
    const duty_t duty = all_realisable(config, want, &changed);
    return (modulate_out_t){duty, changed != 0U};
}

/* Far beyond the hexagon, or with a dc voltage too low to divide by: at half the size the phases fit. */
static __attribute__((noinline, cold)) fx_pair_t halved(fx_pair_t u, fx_pair_t at, int32_t v_dc)
{
    const ab_t v = normalise(u, at, v_dc);
    return fx_arch_pkhbt(fx_sat_q15_word(v.alpha) >> 1, fx_sat_q15_word(v.beta) >> 1);
}

modulate_out_t modulate_step(const modulate_config_t *config, const modulate_in_t *in)
{
    const fx_pair_t u = fx_arch_pkhbt(in->u.d, in->u.q);
    const phases_t sign = polarity(config, in->i, in->advanced);
    const bool fits = fits_q31(config, u, in->v_dc);
    const int32_t v_dc = fits ? in->v_dc : fx_max_s32(in->v_dc, config->v_dc_min);
    ab_t v;
    if (fits) {
        v = normalise(u, in->advanced, v_dc);
    } else {
        const fx_pair_t half = halved(u, in->advanced, v_dc);
        v = (ab_t){(int16_t)(half & 0xFFFFU), (int16_t)(half >> 16)};
    }
    const phases_t y = centred_q31(v);
    const phases_t x = off_middle(y);
    const int32_t margin = (config->min_pulse + config->dead_time) * 0x10000;
    if (fits && farthest(x) < 0x40000000 - margin) { /* whatever the dead time adds, no pulse is too short */
        return (modulate_out_t){plain(config, y, sign), false};
    }
    modulate_out_t out = near_the_hexagon(config, x, fits ? 0 : 1, sign);
    out.limited = out.limited || v_dc != in->v_dc;
    return out;
}

duty_t modulate_clear(const modulate_config_t *config, fx_pair_t u, fx_pair_t i, fx_pair_t advanced, int32_t v_dc)
{
    return plain(config, centred_q31(normalise(u, advanced, v_dc)), polarity(config, i, advanced));
}
