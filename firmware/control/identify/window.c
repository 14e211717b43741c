/* SPDX-License-Identifier: Apache-2.0 */
#include "control/identify/window.h"

#include "fx/codegen.h"
#include "fx/format.h"

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

void identify_window_add(identify_window_t *window, const identify_sample_t *in)
{
    add(&window->sum_i, in->i);
    add(&window->sum_u, in->u);
}

void identify_window_end(identify_window_t *window, const identify_sample_t *in)
{
    window->last = (identify_end_t){
        .i = halfwords(in->i.d, in->i.q),
        .u = halfwords(in->u.d, in->u.q),
        .psi = halfwords(in->flux->psi_d, in->flux->psi_q),
        .theta = in->theta,
    };
}

void identify_window_restart(identify_window_t *window)
{
    window->first = window->last;
    window->sum_i = (dq_q15_t){0, 0};
    window->sum_u = (dq_q15_t){0, 0};
    window->limited = 0;
    window->acting = true;
}
