/* SPDX-License-Identifier: Apache-2.0 */
#include "control/identify/window.h"

static void add(dq_q15_t *sum, dq_q15_t x)
{
    const fx_two_words_t s = FX_LOAD_TWO(sum, d, q);
    int32_t d = s.first + x.d;
    int32_t q = s.second + x.q;
    fx_both_loaded(&d, &q);
    *sum = (dq_q15_t){d, q};
}

static dq_q15_halfword_t halfwords(int32_t d, int32_t q)
{
    return (dq_q15_halfword_t){fx_sat_q15(d), fx_sat_q15(q)};
}

bool identify_window_step(identify_window_t *window, const identify_sample_t *in)
{
    add(&window->sum_i, in->i);
    add(&window->sum_u, in->u);
    const uint32_t left = window->left - 1U;
    if (__builtin_expect(left != 0U, 1)) {
        window->left = left; /* in this branch: before it, the comparison would cost an instruction */
        return false;
    }
    window->left = 0;
    window->last = (identify_end_t){
        .i = halfwords(in->i.d, in->i.q),
        .u = halfwords(in->u.d, in->u.q),
        .psi = halfwords(in->flux->psi_d, in->flux->psi_q),
        .theta = in->theta,
    };
    return true;
}

void identify_window_restart(identify_window_t *window, uint32_t periods)
{
    window->first = window->last;
    window->sum_i = (dq_q15_t){0, 0};
    window->sum_u = (dq_q15_t){0, 0};
    window->left = periods;
    window->limited = 0;
    window->acting = true;
}
