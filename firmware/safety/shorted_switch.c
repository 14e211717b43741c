/* SPDX-License-Identifier: Apache-2.0 */
#include "safety/shorted_switch.h"

#include <stdbool.h>

#include "fx/codegen.h"
#include "fx/div.h"

#define PHASES 3
/* Voltages are 2 pi/8 times per unit, r six times that. */
#define EIGHTH_OF_TURN Q15(0.78539816339744831)
#define GAIN_TO_EIGHTH Q15(0.5) /* Q15 times Q15 to the upper word, as an eighth */
/* Six times the smallest r of a shorted switch, per v_dc. */
#define ALL_KNOWN Q15(6.0 / 8.0)
#define QUARTER_OF_TWO_KNOWN Q15(6.0 * 25.0 / 48.0 / 4.0)
#define ONE_Q15 32768

typedef struct {
    int32_t six_u[PHASES]; /* mean voltages over the period, times six */
    int32_t g[PHASES];     /* q15 */
    int32_t i[PHASES];     /* at the end */
    bool turned[PHASES];   /* the current has turned around */
    bool any_turned;
    int known; /* number of phases with a direction */
} phases_t;

static inline FX_INLINED_IF_OPTIMISED int32_t size_of(int32_t x)
{
    return (x < 0) ? -x : x;
}

static inline FX_INLINED_IF_OPTIMISED void add_phase(phases_t *phases, int x, int32_t last, int32_t now, int32_t i_min)
{
    const int32_t size = size_of(now), size_last = size_of(last);
    phases->i[x] = now;
    phases->turned[x] = false;
    phases->g[x] = 0;
    if (size <= i_min) {
        return;
    }
    phases->known++;
    if (size_last <= i_min || (last ^ now) >= 0) {
        phases->g[x] = (now > 0) ? ONE_Q15 : -ONE_Q15;
    } else {
        phases->g[x] = fx_div_q15((last + now) >> 1, (size_last + size) >> 1);
        phases->turned[x] = true;
        phases->any_turned = true;
    }
}

static inline FX_INLINED_IF_OPTIMISED void find_phases(phases_t *phases, const shorted_switch_in_t *in)
{
    const fx_pair_t added = fx_pair_sub(in->psi, in->psi_last);
    const int32_t alpha = (int16_t)(added & 0xFFFFU);
    const int32_t side = fx_mul_q15((int16_t)(added >> 16), Q15(SQRT3_HALF));
    const int32_t b = side - (alpha >> 1);
    const int32_t gain = in->turn_gain;
    phases->six_u[0] = 6 * fx_mulhi(alpha * GAIN_TO_EIGHTH, gain);
    phases->six_u[1] = 6 * fx_mulhi(b * GAIN_TO_EIGHTH, gain);
    phases->six_u[2] = -phases->six_u[0] - phases->six_u[1];
    phases->known = 0;
    phases->any_turned = false;
    add_phase(phases, 0, in->i_last.a, in->i.a, in->i_min);
    add_phase(phases, 1, in->i_last.b, in->i.b, in->i_min);
    add_phase(phases, 2, in->i_last.c, in->i.c, in->i_min);
}

static inline FX_INLINED_IF_OPTIMISED int32_t six_r_of(const phases_t *phases, int x, int32_t sum, int32_t v_dc)
{
    return phases->six_u[x] + ((v_dc * ((3 * phases->g[x] - sum) >> 3)) >> 12);
}

/* The phase whose r has the largest magnitude, and six times that r. */
static inline FX_INLINED_IF_OPTIMISED int largest_of(const phases_t *phases, int32_t v_dc, int32_t *six_r)
{
    const int32_t sum = phases->g[0] + phases->g[1] + phases->g[2];
    const int32_t r[PHASES] = {six_r_of(phases, 0, sum, v_dc), six_r_of(phases, 1, sum, v_dc),
                               six_r_of(phases, 2, sum, v_dc)};
    int largest = (size_of(r[1]) > size_of(r[0])) ? 1 : 0;
    largest = (size_of(r[2]) > size_of(r[largest])) ? 2 : largest;
    *six_r = r[largest];
    return largest;
}

/* The straight line is only a bound for the phase that has turned around itself. */
static void discard_turned(phases_t *phases)
{
    for (int x = 0; x < PHASES; x++) {
        if (phases->turned[x]) {
            phases->g[x] = 0;
            phases->known--;
        }
    }
}

shorted_switch_t shorted_switch_find(const shorted_switch_in_t *in)
{
    const q15_t v_dc = fx_mul_q15((q15_t)in->v_dc, EIGHTH_OF_TURN);
    phases_t phases;
    int32_t six_r = 0;
    find_phases(&phases, in);
    int x = largest_of(&phases, v_dc, &six_r);
    if (phases.any_turned && !phases.turned[x]) {
        discard_turned(&phases);
        x = largest_of(&phases, v_dc, &six_r);
    }
    const int32_t least = (phases.known == PHASES) ? fx_mul_q15(v_dc, ALL_KNOWN)
                                                   : 4 * fx_mul_q15(v_dc, QUARTER_OF_TWO_KNOWN);
    if (phases.known < 2) {
        return SHORTED_SWITCH_NONE;
    }
    if (six_r > least && phases.i[x] > in->i_min) {
        return SHORTED_SWITCH_UPPER;
    }
    return (six_r < -least && phases.i[x] < -in->i_min) ? SHORTED_SWITCH_LOWER : SHORTED_SWITCH_NONE;
}
