/* SPDX-License-Identifier: Apache-2.0 */
#include "fx/div.h"

/* 2^30 and half a denominator fit 32 bits. */
q15_t fx_div_q15(int32_t num, int32_t den)
{
    if (den == 0) {
        return (q15_t)((num == 0) ? 0 : ((num >> 31) ^ INT16_MAX));
    }
    const int32_t half = ((den < 0) ? -den : den) >> 1;
    return fx_sat_q15((num * 32768 + ((num < 0) ? -half : half)) / den);
}

/* Without branches: the compiler would join those of two magnitudes, in 20 bytes more. */
static uint32_t magnitude_of(int32_t x)
{
    const uint32_t sign = (uint32_t)(x >> 31);
    return ((uint32_t)x ^ sign) - sign;
}

q31_t fx_div_q31(int32_t num, int32_t den)
{
    const uint32_t n = magnitude_of(num), d = magnitude_of(den);
    const int32_t sign = (num ^ den) >> 31;
    if (n >= d) {
        return (n == 0U) ? 0 : (sign ^ INT32_MAX);
    }
    /* The common shift keeps n < d. The quotient n / d * 2^32 is halved when it is rounded. */
    const unsigned shift = fx_leading_zeros(d);
    const uint32_t d_high = (d << shift) >> 16;
    const uint32_t d_low = (d << shift) & 0xFFFFU;
    uint32_t remainder = n << shift;
    uint32_t quotient = 0U;
    /* Two digits of base 2^16. The estimate from the divisor's upper half is at most 2 too large (FX-11). */
    for (unsigned k = 0U; k < 2U; k++) {
        uint32_t digit = remainder / d_high;
        uint32_t left = remainder - (digit * d_high);
        while ((left <= 0xFFFFU) && ((digit * d_low) > (left << 16))) {
            digit--;
            left += d_high;
        }
        remainder = (left << 16) - (digit * d_low);
        quotient = (quotient << 16) + digit;
    }
    /* At most 2^32 - 2, because n <= d - 1 and d <= 2^31. */
    const int32_t magnitude = (int32_t)((quotient + 1U) >> 1);
    return (sign != 0) ? -magnitude : magnitude;
}
