/* SPDX-License-Identifier: Apache-2.0 */
#include "fx/vec.h"

#include "fx/sqrt.h"

q15_t fx_magnitude(q15_t x, q15_t y)
{
    /* Each square is at most 2^30, so the sum, at most 2^31, fits the unsigned argument. */
    return fx_sqrt_q30((uint32_t)fx_mul_q30(x, x) + (uint32_t)fx_mul_q30(y, y));
}

q15_t fx_leg(q15_t length, q15_t x)
{
    const int32_t square = fx_mul_q30(length, length) - fx_mul_q30(x, x);
    return fx_sqrt_q30((uint32_t)fx_max_s32(square, 0));
}
