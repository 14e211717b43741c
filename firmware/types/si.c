/* SPDX-License-Identifier: Apache-2.0 */
#include "types/si.h"

#include "fx/codegen.h"

#define Q15_ONE 32768.0F
#define Q31_ONE 2147483648.0F

float si_from_q15(int32_t x, float base)
{
    return (float)x / Q15_ONE * base;
}

float si_from_q31(int32_t x, float base)
{
    return (float)x / Q31_ONE * base;
}

/* |x| < 2^31 */
static int32_t nearest(float x)
{
    return (int32_t)((x < 0.0F) ? x - 0.5F : x + 0.5F);
}

/* The largest float below 1 times 2^31 is 2^31 - 128: the comparisons keep the conversions inside of int32_t. */
q31_t q31_from_si(float value, float base)
{
    const float x = value / base;
    return (x >= 1.0F) ? Q31_MAX : (x > -1.0F) ? nearest(x * Q31_ONE) : -Q31_MAX;
}

/* Not inlined: no step needs it often, and ten copies would take 400 bytes. */
FX_NOT_INLINED q15_t q15_from_si(float value, float base)
{
    const float x = value / base;
    return (x >= 1.0F) ? Q15_MAX : (x > -1.0F) ? fx_sat_q15(nearest(x * Q15_ONE)) : (q15_t)-Q15_MAX;
}
