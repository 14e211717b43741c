/* SPDX-License-Identifier: Apache-2.0 */
#include "fx/vec.h"

#include "fx/codegen.h"
#include "fx/sqrt.h"

static int32_t square(int32_t x)
{
    return fx_mul_q30((q15_t)x, (q15_t)x);
}

FX_NOT_INLINED q15_t fx_root(uint32_t q30)
{
    return fx_sqrt_q30(q30);
}

q15_t fx_magnitude(int32_t x, int32_t y)
{
    /* Each square is at most 2^30, so the sum, at most 2^31, fits the unsigned argument. */
    return fx_root((uint32_t)square(x) + (uint32_t)square(y));
}
