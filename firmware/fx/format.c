/* SPDX-License-Identifier: Apache-2.0 */
#include "fx/format.h"

q15_t fx_abs_q15(int32_t a)
{
    const int32_t sign = a >> 31;
    return fx_sat_q15((a ^ sign) - sign);
}

q31_t fx_abs_q31(q31_t a)
{
    const int32_t sign = a >> 31;
    return fx_sub_q31(a ^ sign, sign); /* ones' complement plus one, saturated */
}

q31_t fx_shl_q31(q31_t x, unsigned n)
{
    const q31_t limit = (x >> 31) ^ INT32_MAX;
    if (n > 31U) {
        return (x == 0) ? 0 : limit;
    }
    const int32_t y = (int32_t)((uint32_t)x << n);
    return ((y >> n) == x) ? y : limit;
}

q31_t fx_sat_q31(int64_t x)
{
    const int32_t high = (int32_t)(x >> 32);
    const int32_t low = (int32_t)(uint32_t)((uint64_t)x & 0xFFFFFFFFU);
    /* In range exactly when the upper word is the sign extension of the lower. */
    return (high == (low >> 31)) ? low : ((high >> 31) ^ INT32_MAX);
}

q15_t fx_q15_from_q31(q31_t x)
{
    return (q15_t)(fx_arch_qadd(x, 0x8000) >> 16);
}
