/* SPDX-License-Identifier: Apache-2.0 */
/* The products of fx/q.h. The solvers cannot show that multiplications of different width are equal. Therefore a
 * specification either multiplies in the width of the function, or one factor is plus or minus a power of two, so that
 * the product is a shift. */
#include "proof.h"

#include "fx/format.c"
#include "fx/q.c"

/* The lower half of a word, with its sign. */
static int32_t lower(uint32_t word)
{
    return (int16_t)(word & 0xFFFFU);
}

static int32_t upper(uint32_t word)
{
    return (int16_t)(word >> 16);
}

static int32_t power_of_two(unsigned k, bool negative)
{
    const int32_t power = (int32_t)(UINT32_C(1) << k);
    return negative ? -power : power;
}

static int64_t times_power(int64_t x, unsigned k, bool negative)
{
    return (negative ? -x : x) * (int64_t)(UINT64_C(1) << k);
}

void proof_fx_mul_q15(void)
{
    q15_t a, b;
    int32_t acc;
    const int32_t product = (int32_t)a * b;
    PROVE(fx_mul_q30(a, b) == product);
    PROVE((uint32_t)fx_mac_q30(acc, a, b) == (uint32_t)((int64_t)acc + product));
    PROVE(fx_mul_q15(a, b) == to_q15(((int64_t)product + 0x4000) >> 15));
}

/* The loops give the solver one constant factor at a time. */
void proof_fx_mulhi(void)
{
    for (unsigned n = 0; n < 62U; n++) {
        const unsigned k = n >> 1;
        const bool negative = (n & 1U) != 0U;
        int32_t a;
        const int32_t b = power_of_two(k, negative);
        PROVE(fx_mulhi(a, b) == (times_power(a, k, negative) + INT64_C(0x80000000)) >> 32);
    }
}

void proof_fx_mulhi_sums(void)
{
    for (unsigned n = 0; n < 12U; n++) {
        const unsigned k = 6U * (n >> 1);
        const bool negative = (n & 1U) != 0U;
        int32_t a, acc;
        const int32_t b = power_of_two(k, negative);
        const int64_t product = times_power(a, k, negative);
        PROVE((uint32_t)fx_mulhi_add(acc, a, b) == (uint32_t)(acc + ((product + INT64_C(0x80000000)) >> 32)));
        /* The instruction rounds after the subtraction. */
        PROVE((uint32_t)fx_mulhi_sub(acc, a, b) == (uint32_t)(acc + ((INT64_C(0x80000000) - product) >> 32)));
    }
}

void proof_fx_mul_q31(void)
{
    for (unsigned n = 0; n < 62U; n++) {
        const unsigned k = n >> 1;
        const bool negative = (n & 1U) != 0U;
        q31_t a;
        const int64_t rounded = (times_power(a, k, negative) + INT64_C(0x40000000)) >> 31;
        PROVE(fx_mul_q31(a, power_of_two(k, negative)) == to_q31(rounded));
    }
    PROVE(fx_mul_q31(Q31_MIN, Q31_MIN) == Q31_MAX);
}

void proof_fx_mul_q31_word(void)
{
    q31_t a;
    int32_t b, acc;
    const int64_t product = ((int64_t)a * (int16_t)((uint32_t)b & 0xFFFFU)) >> 16;
    PROVE(fx_mul_q31_word(a, b) == product);
    PROVE((uint32_t)fx_mac_q31_word(acc, a, b) == (uint32_t)(acc + product));
}

void proof_fx_mul_gain(void)
{
    q16_t gain;
    q15_t x;
    const int64_t product = (int64_t)gain * ((int32_t)x * 65536); /* in 2^-32 of the result */
    PROVE(fx_mul_gain_q15(gain, x) == to_q15((product + INT64_C(0x80000000)) >> 32));
}

void proof_fx_mul_gain_q31(void)
{
    for (unsigned n = 0; n < 62U; n++) {
        const unsigned k = n >> 1;
        const bool negative = (n & 1U) != 0U;
        q31_t x;
        PROVE(fx_mul_gain_q31(power_of_two(k, negative), x) == to_q31((times_power(x, k, negative) + 0x8000) >> 16));
    }
}

void proof_fx_pair(void)
{
    int32_t low, high;
    const fx_pair_t pair = fx_pair(low, high);
    PROVE(lower(pair) == lower((uint32_t)low) && upper(pair) == lower((uint32_t)high));
}

void proof_fx_dual_products(void)
{
    for (unsigned n = 0; n < 12U; n++) {
        const unsigned k_low = 7U * (n >> 2), k_high = 14U - k_low;
        const bool low_negative = (n & 1U) != 0U, high_negative = (n & 2U) != 0U;
        fx_pair_t a;
        int32_t acc;
        const fx_pair_t b = fx_pair(power_of_two(k_low, low_negative), power_of_two(k_high, high_negative));
        const int64_t ll = times_power(lower(a), k_low, low_negative),
                      uu = times_power(upper(a), k_high, high_negative);
        const int64_t lu = times_power(lower(a), k_high, high_negative),
                      ul = times_power(upper(a), k_low, low_negative);
        PROVE(fx_dot2(a, b) == ll + uu);
        PROVE((uint32_t)fx_dot2_acc(acc, a, b) == (uint32_t)acc + (uint32_t)(ll + uu));
        PROVE(fx_dot2_cross(a, b) == lu + ul);
        PROVE(fx_difference2(a, b) == ll - uu);
        PROVE((uint32_t)fx_difference2_cross_acc(acc, a, b) == (uint32_t)acc + (uint32_t)(lu - ul));
    }
}
