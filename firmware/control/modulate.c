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

/* What a period that cannot be as commanded is made from. */
typedef struct {
    phases_t want, sign;
    fx_pair_t advanced;
    int32_t v_dc;
} cut_t;

/* Q15 vector to Q30 phases; they sum to zero exactly, and |x| < 1.4, so that two differ by less than 2^32. */
static phases_t phases_q30(int32_t alpha, int32_t beta)
{
    const int32_t half = alpha * 16384;
    const int32_t side = beta * Q15(0.86602540378443865);
    return (phases_t){alpha * DUTY_ONE, side - half, side - half - 2 * side};
}

/* Stator voltage in units of v_dc. Q17 * Q30 = Q15. */
static ab_t normalise(dq_t u, fx_pair_t at, int32_t v_dc)
{
    const int32_t per_v_dc = (int32_t)(UINT32_MAX / (uint32_t)v_dc);
    const ab_t v = inverse_park_q30(u, at);
    return (ab_t){fx_mulhi(per_v_dc, v.alpha), fx_mulhi(per_v_dc, v.beta)};
}

/* The middle one of three phases: as they sum to zero, minus the sum of the outer two. */
static int32_t middle(phases_t x)
{
    if (x.a < x.b) {
        return (x.b < x.c) ? x.b : fx_max_s32(x.a, x.c);
    }
    return (x.a < x.c) ? x.a : fx_max_s32(x.b, x.c);
}

/* Currents of the phases at the middle of the acting period, as polarity: Q15, 1.0 beyond the knee (MO-6). */
static phases_t polarity(const modulate_config_t *config, dq_t i, fx_pair_t at)
{
    const ab_t x = inverse_park_q30(i, at);
    const int32_t a = fx_mulhi(config->knee_q17, x.alpha); /* Q17 * Q30 = Q15, below 2^29 */
    const int32_t side = fx_mulhi(config->knee_side_q17, x.beta);
    const int32_t b = side - (a >> 1);
    return (phases_t){fx_sat_q15_word(a), fx_sat_q15_word(b), fx_sat_q15_word(b - 2 * side)};
}

/* Min-max zero sequence: both ends equally far from the rails (MO-4). One rounding for the whole duty. */
static phases_t centred(phases_t x, phases_t sign, int32_t dead_time)
{
    const int32_t shift = DUTY_HALF * DUTY_ONE + 0x4000 + (middle(x) >> 1);
    return (phases_t){(x.a + shift + dead_time * sign.a) >> 15, (x.b + shift + dead_time * sign.b) >> 15,
                      (x.c + shift + dead_time * sign.c) >> 15};
}

/* A vector beyond the hexagon is shortened along its own direction (MO-3). */
static phases_t shorten(ab_t v, uint32_t span)
{
    const q15_t by = fx_sat_q15((int32_t)((SPAN_MAX_Q30 - 1U) / ((span + 0x7FFFU) >> 15)));
    return phases_q30((v.alpha * by + 0x4000) >> 15, (v.beta * by + 0x4000) >> 15);
}

/* Pulses and gaps shorter than the bridge can make snap to the nearer of nothing and the shortest (MO-8). */
static uint32_t realisable(int32_t duty, int32_t min_pulse)
{
    if (duty < min_pulse) {
        return (2 * duty < min_pulse) ? 0U : (uint32_t)min_pulse;
    }
    if (duty > DUTY_ONE - min_pulse) {
        const int32_t gap = DUTY_ONE - duty;
        return (uint32_t)((2 * gap < min_pulse) ? DUTY_ONE : DUTY_ONE - min_pulse);
    }
    return (uint32_t)duty;
}

/* A phase that does not switch has no dead time: its compensation is not taken away again (MO-9). */
static int32_t effective(uint32_t duty, int32_t compensation)
{
    return (duty == 0 || duty == DUTY_ONE) ? (int32_t)duty : (int32_t)duty - compensation;
}

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
static void limit(const modulate_config_t *config, const cut_t *cut, modulate_out_t *out)
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

/* Near the hexagon, or a dc voltage too low to divide by. */
static __attribute__((noinline)) void careful(const modulate_config_t *config, const modulate_in_t *in,
                                              modulate_out_t *out)
{
    const int32_t v_dc = fx_max_s32(in->v_dc, config->v_dc_min);
    const fx_pair_t advanced = fx_rotation(in->theta);
    ab_t v = normalise(in->u, advanced, v_dc);
    v = (ab_t){fx_sat_q15_word(v.alpha), fx_sat_q15_word(v.beta)};
    phases_t x = phases_q30(v.alpha, v.beta);
    const int32_t hi = fx_max_s32(x.a, fx_max_s32(x.b, x.c));
    const int32_t lo = fx_min_s32(x.a, fx_min_s32(x.b, x.c));
    const uint32_t span = (uint32_t)hi - (uint32_t)lo; /* up to 2.8 in Q30: unsigned */
    if (span > SPAN_MAX_Q30) {
        x = shorten(v, span);
    }
    const phases_t sign = polarity(config, in->i, advanced);
    const cut_t cut = {centred(x, sign, config->dead_time), sign, advanced, in->v_dc};
    const int32_t pulse = config->min_pulse;
    if (span <= SPAN_MAX_Q30 && v_dc == in->v_dc && within(cut.want.a, pulse) && within(cut.want.b, pulse) &&
        within(cut.want.c, pulse)) {
        out->duty = (duty_t){(uint32_t)cut.want.a, (uint32_t)cut.want.b, (uint32_t)cut.want.c};
        out->acted = in->u;
        out->limited = false;
    } else {
        limit(config, &cut, out);
    }
}

/* Where nothing limits: |v| < 0.58, the phases fit Q31, and their upper halves are the duties; unsigned, as only they
 * need to be in range. */
static duty_t plain(const modulate_config_t *config, ab_t v, phases_t sign)
{
    const int32_t side = fx_arch_opaque(v.beta * Q16(0.86602540378443865)); /* Q15 * Q16 = Q31 */
    const int32_t b = side - v.alpha * DUTY_ONE;
    const phases_t x = {v.alpha * (2 * DUTY_ONE), b, b - 2 * side};
    const uint32_t shift = (uint32_t)fx_arch_opaque(0x40008000) + (uint32_t)(middle(x) >> 1);
    const int32_t dead_time = 2 * config->dead_time;
    const uint32_t a_q31 = (uint32_t)x.a + shift + (uint32_t)(dead_time * sign.a);
    const uint32_t b_q31 = (uint32_t)x.b + shift + (uint32_t)(dead_time * sign.b);
    const uint32_t c_q31 = (uint32_t)x.c + shift + (uint32_t)(dead_time * sign.c);
    return (duty_t){a_q31 >> 16, b_q31 >> 16, c_q31 >> 16};
}

modulate_out_t modulate_step(const modulate_config_t *config, const modulate_in_t *in)
{
    modulate_out_t out;
    if (!in->clear) {
        const modulate_in_t near = *in; /* a copy: the usual case keeps its values in registers */
        careful(config, &near, &out);
        return out;
    }
    const fx_pair_t advanced = fx_rotation(in->theta);
    const ab_t v = normalise(in->u, advanced, in->v_dc);
    return (modulate_out_t){plain(config, v, polarity(config, in->i, advanced)), in->u, false};
}
