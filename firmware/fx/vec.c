/* SPDX-License-Identifier: Apache-2.0 */
#include "fx/vec.h"

#include "fx/sqrt.h"

q15_t fx_magnitude(q15_t x, q15_t y)
{
    /* Each square is at most 2^30, so the sum, at most 2^31, fits the unsigned argument. */
    return fx_sqrt_q30((uint32_t)fx_mul_q30(x, x) + (uint32_t)fx_mul_q30(y, y));
}
