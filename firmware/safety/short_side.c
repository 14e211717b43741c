/* SPDX-License-Identifier: Apache-2.0 */
#include "safety/short_side.h"

#include "signal/mean.h"

#define MEAN_SHIFT 5

void short_side_step(short_side_state_t *state, const short_side_in_t *in)
{
    if (!in->acting) {
        *state = in->shorted ? *state : (short_side_state_t){0};
        return;
    }
    state->a_q8 = mean_step(state->a_q8, (in->i.a - in->i_ref.a) * 256, MEAN_SHIFT);
    state->b_q8 = mean_step(state->b_q8, (in->i.b - in->i_ref.b) * 256, MEAN_SHIFT);
}

bool short_side_is_upper(const short_side_state_t *state, q15_t i_min)
{
    const int32_t c_q8 = -state->a_q8 - state->b_q8;
    const int32_t highest = fx_max_s32(fx_max_s32(state->a_q8, state->b_q8), c_q8);
    const int32_t lowest = fx_min_s32(fx_min_s32(state->a_q8, state->b_q8), c_q8);
    return highest > i_min * 256 && highest > -lowest;
}
