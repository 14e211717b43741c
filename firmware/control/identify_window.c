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

bool identify_window_step(identify_window_t *window, const identify_sample_t *in)
{
    if (window->count >= IDENTIFY_PERIODS) {
        restart(window);
    }
    window->sum_i.d += in->i.d;
    window->sum_i.q += in->i.q;
    window->sum_u.d += in->u.d;
    window->sum_u.q += in->u.q;
    window->acting = window->acting && in->acting;
    window->limited = (uint8_t)(window->limited + (in->limited ? 1U : 0U));
    window->count++;
    if (window->count < IDENTIFY_PERIODS) {
        return false;
    }
    window->last = (identify_end_t){in->i, in->u, {in->flux->psi_d, in->flux->psi_q}, in->theta};
    return true;
}
