/* SPDX-License-Identifier: Apache-2.0 */
#include "control/identify_window.h"

static void add(dq_t *sum, dq_t x)
{
    const fx_arch_two_t s = fx_arch_load_two(&sum->d);
    int32_t d = s.first + x.d;
    int32_t q = s.second + x.q;
    fx_arch_together(&d, &q);
    *sum = (dq_t){d, q};
}

static identify_pair_t half(int32_t d, int32_t q)
{
    return (identify_pair_t){fx_sat_q15(d), fx_sat_q15(q)};
}

bool identify_window_step(identify_window_t *window, const identify_sample_t *in)
{
    add(&window->sum_i, in->i);
    add(&window->sum_u, in->u);
    const uint32_t count = window->count + 1U;
    window->count = count;
    if (__builtin_expect(count < IDENTIFY_PERIODS, 1)) {
        return false;
    }
    window->last = (identify_end_t){
        .i = half(in->i.d, in->i.q),
        .u = half(in->u.d, in->u.q),
        .psi = half(in->flux->psi_d, in->flux->psi_q),
        .theta = in->theta,
    };
    return true;
}

void identify_window_restart(identify_window_t *window)
{
    window->first = window->last;
    window->sum_i = (dq_t){0, 0};
    window->sum_u = (dq_t){0, 0};
    window->count = 0;
    window->limited = 0;
    window->acting = true;
}
