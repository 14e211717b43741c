/* SPDX-License-Identifier: Apache-2.0 */
#include "control/identify_window.h"

/* Begins with what ended the window before. */
static void restart(identify_window_t *window, const identify_sample_t *in)
{
    window->first = window->last;
    window->sum_i = in->i;
    window->sum_u = in->u;
    window->count = 1;
    window->limited = in->limited ? 1 : 0;
    window->acting = in->acting;
}

static void add(dq_t *sum, dq_t x)
{
    dq_t s = *sum;
    fx_arch_together(&s.d, &s.q);
    sum->d = s.d + x.d;
    sum->q = s.q + x.q;
}

/* A window that is full is found by its count alone, after the sums: one comparison for both of its ends. */
bool identify_window_step(identify_window_t *window, const identify_sample_t *in)
{
    add(&window->sum_i, in->i);
    add(&window->sum_u, in->u);
    if (__builtin_expect(!in->acting, 0)) {
        window->acting = false;
    }
    if (__builtin_expect(in->limited, 0)) {
        window->limited++;
    }
    const uint32_t count = ++window->count;
    if (__builtin_expect(count < IDENTIFY_PERIODS, 1)) {
        return false;
    }
    if (count > IDENTIFY_PERIODS) {
        restart(window, in);
        return false;
    }
    window->last = (identify_end_t){in->i, in->u, {in->flux->psi_d, in->flux->psi_q}, in->theta};
    return true;
}
