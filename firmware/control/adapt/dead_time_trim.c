/* SPDX-License-Identifier: Apache-2.0 */
#include "control/adapt/dead_time_trim.h"

#include "fx/codegen.h"
#include "fx/div.h"

#define TIME_CONSTANT_SHIFT 4      /* 16 moves of the trim until 1/e of the error is left */
#define VARIANCE_MAX_Q30 (1 << 28) /* a quarter of the prior's variance: half of its standard deviation */
#define RANGE_SHIFT 2              /* base +- base/4 */

static FX_NOT_INLINED int32_t limited(int32_t base, int32_t trim)
{
    const int32_t max = base >> RANGE_SHIFT;
    return fx_clamp_q31(trim, -max, max);
}

/* Voltage error that is not compensated yet (DT-1), in LSB of delta. */
static int32_t uncompensated(const dead_time_trim_in_t *in)
{
    const int32_t drop = fx_mulhi(in->sigma, in->x_q27);                       /* Q31 * Q27 = Q26 */
    return fx_shl_q31(fx_mulhi(drop, Q31(0.78539816339744831)), 5) / in->v_dc; /* Q30/Q15, v_dc > 0 */
}

/* (DT-3): delta v_dc = Q30; 4/pi = 2 * 2/pi and Q30 to Q31 are the factor of four. */
static int32_t x_shift(const dead_time_trim_in_t *in, int32_t change)
{
    const q31_t drop = 2 * fx_mulhi(4 * change * in->v_dc, Q31(0.63661977236758134));
    return -(fx_div_q31(drop, in->sigma) / 16); /* Q31 to Q27 */
}

dead_time_trim_t dead_time_trim_step(dead_time_trim_state_t *state, const dead_time_trim_in_t *in)
{
    if (in->dead_time != state->base + state->trim) {
        *state = (dead_time_trim_state_t){.base = in->dead_time};
    }
    state->steps = (uint16_t)(state->steps + (in->identifying ? 1U : 0U));
    if (state->steps < in->period_steps) {
        return (dead_time_trim_t){in->dead_time, 0};
    }
    state->steps = 0;
    if (in->variance_q30 > VARIANCE_MAX_Q30 || in->v_dc <= 0) {
        return (dead_time_trim_t){in->dead_time, 0};
    }
    const int32_t w = uncompensated(in);
    /* Away from 0: at least 1 LSB unless w is 0. */
    const int32_t round_up = (w > 0) ? (1 << TIME_CONSTANT_SHIFT) - 1 : 0;
    const int32_t before = state->trim;
    state->trim = (q15_t)limited(state->base, before + ((w + round_up) >> TIME_CONSTANT_SHIFT));
    return (dead_time_trim_t){(q15_t)(state->base + state->trim), x_shift(in, state->trim - before)};
}

q15_t dead_time_trim_restore(dead_time_trim_state_t *state, q15_t dead_time, int32_t trim)
{
    const q15_t base = (dead_time == state->base + state->trim) ? state->base : dead_time;
    *state = (dead_time_trim_state_t){.base = base, .trim = (q15_t)limited(base, trim)};
    return (q15_t)(base + state->trim);
}
