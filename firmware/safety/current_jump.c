/* SPDX-License-Identifier: Apache-2.0 */
#include "safety/current_jump.h"

#include "fx/q.h"

/* (MN-58): by a sixteenth to a half of the current, and along it within 26 degrees. */
static bool is_along(dq_q15_t i, dq_q15_t now)
{
    const dq_q15_t half = {i.d >> 1, i.q >> 1}, moved = {(now.d - i.d) >> 1, (now.q - i.q) >> 1};
    const int32_t along = half.d * moved.d + half.q * moved.q;
    const int32_t across = half.d * moved.q - half.q * moved.d;
    const uint32_t of_current = (uint32_t)(half.d * half.d) + (uint32_t)(half.q * half.q);
    const uint32_t of_jump = current_jump_moved(i, now);
    return of_jump > of_current >> 8 && of_jump < of_current >> 2 && fx_abs_q31(across) < fx_abs_q31(along) / 2;
}

bool current_jump_is_of_gain(dq_q15_t last, dq_q15_t i, dq_q15_t next)
{
    return is_along(last, i) && current_jump_moved(i, next) < current_jump_moved(last, i) >> 4;
}
