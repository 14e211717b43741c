/* SPDX-License-Identifier: Apache-2.0 */
#include "fx/format.h"

q31_t fx_shl_q31(q31_t x, unsigned n)
{
    const q31_t limit = (x >> 31) ^ INT32_MAX;
    if (n > 31U) {
        return (x == 0) ? 0 : limit;
    }
    const int32_t y = (int32_t)((uint32_t)x << n);
    return ((y >> n) == x) ? y : limit;
}
