/* SPDX-License-Identifier: Apache-2.0 */
#include "safety/current_jump.h"

#include "fx/q.h"

/* Halved components: their squares fit a word. */
static dq_q15_t half_of_difference(dq_q15_t a, dq_q15_t b)
{
    return (dq_q15_t){(a.d - b.d) >> 1, (a.q - b.q) >> 1};
}

static uint32_t squared(dq_q15_t x)
{
    return (uint32_t)(x.d * x.d) + (uint32_t)(x.q * x.q);
}

/* (MN-58): by a sixteenth to a half of the current, and along it within 26 degrees. */
static bool is_along(dq_q15_t i, dq_q15_t moved)
{
    const dq_q15_t half = {i.d >> 1, i.q >> 1};
    const int32_t along = half.d * moved.d + half.q * moved.q;
    const int32_t across = half.d * moved.q - half.q * moved.d;
    const uint32_t of_current = squared(half), of_jump = squared(moved);
    return of_jump > of_current >> 8 && of_jump < of_current >> 2 && fx_abs_q31(across) < fx_abs_q31(along) / 2;
}

bool current_jump_stays(const current_jump_t *jump, dq_q15_t i)
{
    return current_jump_moved(jump->last, i) < jump->jump >> 4;
}

void current_jump_step(current_jump_t *jump, dq_q15_t i)
{
    const dq_q15_t moved = half_of_difference(i, jump->last);
    const uint32_t of_jump = squared(moved);
    const bool stands_out = current_jump_stands_out(of_jump, jump->largest) &&
                            current_jump_stands_out(of_jump, jump->before);
    jump->jump = (stands_out && is_along(jump->last, moved)) ? of_jump : 0U;
    jump->largest = (of_jump > jump->largest) ? of_jump : jump->largest;
    jump->last = i;
}
