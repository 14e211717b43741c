/* SPDX-License-Identifier: Apache-2.0 */
#include "control/modulate.h"

#include "control/transform.h"
#include "fx/q.h"

#define DUTY_ONE 32768
#define DUTY_HALF 16384
/* One count below the full range, in Q30: the largest distance between two phases. */
#define SPAN_MAX_Q30 (32766U << 15)

typedef struct {
    int32_t a, b, c;
} phases_t;

/* Q15 vector to Q30 phases; they sum to zero exactly, and |x| < 1.4, so that two differ by less than 2^32. */
static phases_t phases_q30(int32_t alpha, int32_t beta)
{
    const int32_t half = alpha * -16384;
    const int32_t side = beta * Q15(0.86602540378443865);
    return (phases_t){alpha * DUTY_ONE, half + side, half - side};
}

static int32_t highest(phases_t x)
{
    return fx_max_s32(x.a, fx_max_s32(x.b, x.c));
}

static int32_t lowest(phases_t x)
{
    return fx_min_s32(x.a, fx_min_s32(x.b, x.c));
}

/* Stator voltage in units of v_dc. Q17 * Q30 = Q15. */
static ab_t normalise(dq_t u, fx_sincos_t at, int32_t v_dc)
{
    const int32_t per_v_dc = (int32_t)(UINT32_MAX / (uint32_t)v_dc);
    const ab_t v = inverse_park_q30(u, at);
    return (ab_t){fx_sat_q15_word(fx_mulhi(per_v_dc, v.alpha)), fx_sat_q15_word(fx_mulhi(per_v_dc, v.beta))};
}

/* A vector beyond the hexagon is shortened along its own direction (MO-3). */
static __attribute__((noinline, cold)) phases_t shorten(ab_t v, uint32_t span)
{
    const q15_t by = fx_sat_q15((int32_t)((SPAN_MAX_Q30 - 1U) / ((span + 0x7FFFU) >> 15)));
    return phases_q30((v.alpha * by + 0x4000) >> 15, (v.beta * by + 0x4000) >> 15);
}

/* Currents of the phases at the middle of the acting period, as polarity: Q15, 1.0 beyond the knee (MO-6). */
static phases_t polarity(q16_t knee_gain, dq_t i, fx_sincos_t at)
{
    const ab_t x = inverse_park_q30(i, at);
    const int32_t side = fx_mulhi(x.beta, Q31(0.86602540378443865)); /* Q30 * Q31 = Q29 */
    const int32_t half = x.alpha >> 2;
    const q16_t gain = knee_gain * 4; /* Q18 * Q29 = Q15 */
    return (phases_t){
        fx_sat_q15_word(fx_mulhi(gain, x.alpha >> 1)),
        fx_sat_q15_word(fx_mulhi(gain, side - half)),
        fx_sat_q15_word(fx_mulhi(gain, -side - half)),
    };
}

/* Pulses and gaps shorter than the bridge can make snap to the nearer of nothing and the shortest (MO-8). */
static uint16_t realisable(int32_t duty, int32_t min_pulse)
{
    if (duty < min_pulse) {
        return (uint16_t)((2 * duty < min_pulse) ? 0 : min_pulse);
    }
    if (duty > DUTY_ONE - min_pulse) {
        const int32_t gap = DUTY_ONE - duty;
        return (uint16_t)((2 * gap < min_pulse) ? DUTY_ONE : DUTY_ONE - min_pulse);
    }
    return (uint16_t)duty;
}

/* A phase that does not switch has no dead time: its compensation is not taken away again (MO-9). */
static int32_t effective(uint16_t duty, int32_t compensation)
{
    return (duty == 0 || duty == DUTY_ONE) ? (int32_t)duty : (int32_t)duty - compensation;
}

/* What a period that cannot be as commanded is made from. */
typedef struct {
    phases_t want, sign;
    fx_sincos_t advanced;
    int32_t v_dc;
} cut_t;

static dq_t acting_voltage(duty_t duty, phases_t c, const cut_t *cut)
{
    const int32_t a = effective(duty.a, c.a);
    const int32_t b = effective(duty.b, c.b);
    const int32_t g = effective(duty.c, c.c);
    /* Clarke of the duties, in units of v_dc; |2a - b - c| <= 2^16 so that Q15 * Q15 stays below 2^31. */
    const ab_t v = {transform_round((2 * a - b - g) * 10923), transform_round((b - g) * 18919)};
    return park((ab_t){transform_round(v.alpha * cut->v_dc), transform_round(v.beta * cut->v_dc)}, cut->advanced);
}

/* Pulses snap, and acted says what they make. */
static __attribute__((noinline, cold)) void limit(const modulate_config_t *config, const cut_t *cut,
                                                  modulate_out_t *out)
{
    const phases_t c = {fx_mul_q15(config->dead_time, (q15_t)cut->sign.a),
                        fx_mul_q15(config->dead_time, (q15_t)cut->sign.b),
                        fx_mul_q15(config->dead_time, (q15_t)cut->sign.c)};
    out->duty = (duty_t){realisable(cut->want.a, config->min_pulse), realisable(cut->want.b, config->min_pulse),
                         realisable(cut->want.c, config->min_pulse)};
    out->acted = acting_voltage(out->duty, c, cut);
    out->limited = true;
}

static bool within(int32_t duty, int32_t min_pulse)
{
    return (uint32_t)(duty - min_pulse) <= (uint32_t)(DUTY_ONE - 2 * min_pulse);
}

void modulate_step(const modulate_config_t *config, const modulate_in_t *in, modulate_out_t *out)
{
    const int32_t v_dc = fx_max_s32(in->v_dc, config->v_dc_min);
    const ab_t v = normalise(in->u, in->advanced, v_dc);
    phases_t x = phases_q30(v.alpha, v.beta);
    int32_t hi = highest(x);
    int32_t lo = lowest(x);
    const uint32_t span = (uint32_t)hi - (uint32_t)lo; /* up to 2.8 in Q30: unsigned */
    if (span > SPAN_MAX_Q30) {
        x = shorten(v, span);
        hi = highest(x);
        lo = lowest(x);
    }
    /* Min-max zero sequence: both ends equally far from the rails (MO-4). One rounding for the whole duty. */
    const int32_t shift = DUTY_HALF * DUTY_ONE + 0x4000 - ((hi + lo) >> 1);
    const phases_t sign = polarity(config->knee_gain, in->i, in->advanced);
    const int32_t dead_time = config->dead_time;
    const phases_t want = {(x.a + shift + dead_time * sign.a) >> 15, (x.b + shift + dead_time * sign.b) >> 15,
                           (x.c + shift + dead_time * sign.c) >> 15};

    const int32_t pulse = config->min_pulse;
    if (span <= SPAN_MAX_Q30 && v_dc == in->v_dc && within(want.a, pulse) && within(want.b, pulse) &&
        within(want.c, pulse)) {
        out->duty = (duty_t){(uint16_t)want.a, (uint16_t)want.b, (uint16_t)want.c};
        out->acted = in->u;
        out->limited = false;
    } else {
        const cut_t cut = {want, sign, {in->advanced.sin, in->advanced.cos}, in->v_dc};
        limit(config, &cut, out);
    }
}
