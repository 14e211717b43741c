/* SPDX-License-Identifier: Apache-2.0 */
#include "control/modulate.h"

#include "control/transform.h"
#include "fx/div.h"
#include "fx/q.h"

#define DUTY_ONE 32768
#define DUTY_HALF 16384

typedef struct {
    int32_t a, b, c;
} phases_t; /* duty units, 2^15 = 1.0, wider than a duty while they are computed */

/* Phase voltages in units of v_dc; a vector beyond the hexagon is shortened along its own direction (MO-3). */
static phases_t normalise(ab_t u, q16_t per_v_dc, bool *shortened)
{
    ab_t v = {fx_mul_gain_q15(per_v_dc, u.alpha), fx_mul_gain_q15(per_v_dc, u.beta)};
    abc_t x = inverse_clarke(v);
    const int32_t hi = fx_max_s32(x.a, fx_max_s32(x.b, x.c));
    const int32_t lo = fx_min_s32(x.a, fx_min_s32(x.b, x.c));
    *shortened = hi - lo > DUTY_ONE - 2;
    if (*shortened) {
        const q15_t shorten = fx_sat_q15(fx_div_s32((DUTY_ONE - 2) * DUTY_ONE - 1, hi - lo)); /* span >= 2^15 - 1: bounded */
        v = (ab_t){fx_mul_q15(v.alpha, shorten), fx_mul_q15(v.beta, shorten)};
        x = inverse_clarke(v);
    }
    return (phases_t){x.a, x.b, x.c};
}

/* Min-max zero sequence: both ends equally far from the rails (MO-4). */
static phases_t centre(phases_t v)
{
    const int32_t hi = fx_max_s32(v.a, fx_max_s32(v.b, v.c));
    const int32_t lo = fx_min_s32(v.a, fx_min_s32(v.b, v.c));
    const int32_t shift = DUTY_HALF - ((hi + lo + 1) >> 1);
    return (phases_t){v.a + shift, v.b + shift, v.c + shift};
}

/* What the dead time will take from each phase: its current at the middle of the acting period decides (MO-6). */
static phases_t dead_time_duty(const modulate_config_t *config, dq_t i, fx_sincos_t advanced)
{
    const abc_t x = inverse_clarke(inverse_park(i, advanced));
    return (phases_t){
        fx_mul_q15(config->dead_time, fx_mul_gain_q15(config->knee_gain, x.a)),
        fx_mul_q15(config->dead_time, fx_mul_gain_q15(config->knee_gain, x.b)),
        fx_mul_q15(config->dead_time, fx_mul_gain_q15(config->knee_gain, x.c)),
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

static dq_t acting_voltage(duty_t duty, phases_t c, const modulate_in_t *in)
{
    const int32_t a = effective(duty.a, c.a);
    const int32_t b = effective(duty.b, c.b);
    const int32_t g = effective(duty.c, c.c);
    /* Clarke of the duties, in units of v_dc; |2a - b - c| <= 2^16 so that Q15 * Q15 stays below 2^31. */
    const ab_t v = {fx_sat_q15(((2 * a - b - g) * 10923 + 0x4000) >> 15), fx_sat_q15(((b - g) * 18919 + 0x4000) >> 15)};
    return park((ab_t){fx_mul_q15(v.alpha, in->v_dc), fx_mul_q15(v.beta, in->v_dc)}, in->advanced);
}

modulate_out_t modulate_step(const modulate_config_t *config, const modulate_in_t *in)
{
    const q15_t v_dc = (q15_t)fx_max_s32(in->v_dc, config->v_dc_min);
    bool shortened = false;
    const phases_t v = normalise(inverse_park(in->u, in->advanced), fx_reciprocal_q16(v_dc), &shortened);
    const phases_t ideal = centre(v);
    const phases_t c = dead_time_duty(config, in->i, in->advanced);
    const phases_t want = {ideal.a + c.a, ideal.b + c.b, ideal.c + c.c};

    modulate_out_t out = {
        .duty = {realisable(want.a, config->min_pulse), realisable(want.b, config->min_pulse),
                 realisable(want.c, config->min_pulse)},
        .acted = in->u,
    };
    out.limited = shortened || v_dc != in->v_dc || out.duty.a != want.a || out.duty.b != want.b || out.duty.c != want.c;
    if (out.limited) {
        out.acted = acting_voltage(out.duty, c, in);
    }
    return out;
}
