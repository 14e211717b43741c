/* SPDX-License-Identifier: Apache-2.0 */
#include "fx/q.h"

q31_t fx_mul_q31(q31_t a, q31_t b)
{
    const int64_t q62 = (int64_t)a * b + INT64_C(0x40000000);
    return ((int32_t)(q62 >> 32) == 0x40000000) ? Q31_MAX : (q31_t)(q62 >> 31);
}

q31_t fx_mul_gain_q31(q16_t gain, q31_t x)
{
    return fx_sat_q31(((int64_t)gain * x + 0x8000) >> 16);
}

q15_t fx_mul_q15(int32_t a, int32_t b)
{
    return fx_sat_q15(fx_mac_q30(0x4000, (q15_t)a, (q15_t)b) >> 15);
}
