/* SPDX-License-Identifier: Apache-2.0 */
#include "control/identify_window.h"

static void restart(identify_window_t *window)
{
    window->first = window->last;
    window->sum_i = (dq_t){0, 0};
    window->sum_u = (dq_t){0, 0};
    window->count = 0;
    window->limited = 0;
    window->acting = true;
}

static void add(dq_t *sum, dq_t x)
{
    dq_t s = *sum;
    fx_arch_together(&s.d, &s.q);
    sum->d = s.d + x.d;
    sum->q = s.q + x.q;
}

bool identify_window_step(identify_window_t *window, const identify_sample_t *in)
{
    if (window->count >= IDENTIFY_PERIODS) {
        restart(window);
    }
    add(&window->sum_i, in->i);
    add(&window->sum_u, in->u);
    if (__builtin_expect(!in->acting, 0)) {
        window->acting = false;
    }
    if (__builtin_expect(in->limited, 0)) {
        window->limited++;
    }
    window->count++;
    if (window->count < IDENTIFY_PERIODS) {
        return false;
    }
    window->last = (identify_end_t){in->i, in->u, {in->flux->psi_d, in->flux->psi_q}, in->theta};
    return true;
}
