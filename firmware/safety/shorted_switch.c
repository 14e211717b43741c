/* SPDX-License-Identifier: Apache-2.0 */
#include "safety/shorted_switch.h"

#include <stdbool.h>

#include "fx/div.h"

/* Voltages are 2 pi/8 times per unit, r six times that. */
#define EIGHTH_OF_TURN Q15(0.78539816339744831)
#define GAIN_TO_EIGHTH 16384 /* Q15 times Q15 to the upper word, as an eighth */
/* Six times the smallest r of a shorted switch, per v_dc. */
#define ALL_KNOWN Q15(6.0 / 8.0)
#define QUARTER_OF_TWO_KNOWN Q15(6.0 * 25.0 / 48.0 / 4.0)

typedef struct {
    int32_t six_u[3]; /* mean voltages over the period, times six */
    int32_t g[3];     /* q15 */
    int32_t i[3];     /* at the end */
    bool turned[3];   /* the current has turned around */
    int known;        /* number of phases with a direction */
} bridge_phases_t;

static void add_phase(bridge_phases_t *phases, int x, int32_t last, int32_t now, int32_t i_min)
{
    const int32_t size = fx_abs_q31(now), size_last = fx_abs_q31(last);
    const bool known = size > i_min;
    const bool from_none = size_last <= i_min;
    phases->i[x] = now;
    phases->known += known ? 1 : 0;
    phases->turned[x] = known && !from_none && (last ^ now) < 0;
    phases->g[x] = known ? fx_div_q15(from_none ? now : last + now, from_none ? size : size_last + size) : 0;
}

/* phases: all zero before. */
static void phases_of(const shorted_switch_in_t *in, bridge_phases_t *phases)
{
    const int32_t alpha = fx_sat_q15(in->psi.alpha - in->psi_last.alpha);
    const int32_t side = fx_mul_q15(fx_sat_q15(in->psi.beta - in->psi_last.beta), Q15(SQRT3_HALF));
    const int32_t b = side - (alpha >> 1);
    const int32_t added[3] = {alpha, b, b - 2 * side};
    for (int x = 0; x < 3; x++) {
        phases->six_u[x] = 6 * fx_mulhi(added[x] * GAIN_TO_EIGHTH, in->turn_gain);
    }
    add_phase(phases, 0, in->i_last.a, in->i.a, in->i_min);
    add_phase(phases, 1, in->i_last.b, in->i.b, in->i_min);
    add_phase(phases, 2, in->i_last.c, in->i.c, in->i_min);
}

/* The phase whose r has the largest magnitude, and six times that r. */
static int largest_of(const bridge_phases_t *phases, int32_t v_dc, int32_t *six_r)
{
    const int32_t sum = phases->g[0] + phases->g[1] + phases->g[2];
    int largest = 0;
    *six_r = 0;
    for (int x = 0; x < 3; x++) {
        const int32_t r = phases->six_u[x] + ((v_dc * ((3 * phases->g[x] - sum) >> 3)) >> 12);
        if (fx_abs_q31(r) > fx_abs_q31(*six_r)) {
            *six_r = r;
            largest = x;
        }
    }
    return largest;
}

/* The straight line is only a bound for the phase that has turned around itself. */
static void discard_turned(bridge_phases_t *phases)
{
    for (int x = 0; x < 3; x++) {
        phases->g[x] = phases->turned[x] ? 0 : phases->g[x];
        phases->known -= phases->turned[x] ? 1 : 0;
    }
}

shorted_switch_t shorted_switch_find(const shorted_switch_in_t *in)
{
    const q15_t v_dc = fx_mul_q15((q15_t)in->v_dc, EIGHTH_OF_TURN);
    bridge_phases_t phases = {0};
    phases_of(in, &phases);
    int32_t six_r;
    int x = largest_of(&phases, v_dc, &six_r);
    if (!phases.turned[x]) {
        discard_turned(&phases);
        x = largest_of(&phases, v_dc, &six_r);
    }
    const int32_t least = (phases.known == 3) ? fx_mul_q15(v_dc, ALL_KNOWN)
                                              : 4 * fx_mul_q15(v_dc, QUARTER_OF_TWO_KNOWN);
    if (phases.known < 2 || fx_abs_q31(six_r) <= least) {
        return SHORTED_SWITCH_NONE;
    }
    if (six_r > 0) {
        return (phases.i[x] > in->i_min) ? SHORTED_SWITCH_UPPER : SHORTED_SWITCH_NONE;
    }
    return (phases.i[x] < -in->i_min) ? SHORTED_SWITCH_LOWER : SHORTED_SWITCH_NONE;
}
