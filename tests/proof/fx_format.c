/* SPDX-License-Identifier: Apache-2.0 */
/* fx/format.h with the portable instructions below it, against 64-bit arithmetic that cannot overflow. */
#include "proof.h"

#include "fx/format.c"

void proof_fx_saturation_q15(void)
{
    int32_t x;
    PROVE(fx_sat_q15(x) == to_q15(x));
    PROVE(fx_sat_q15_word(x) == to_q15(x));
    PROVE(fx_usat_q15_word(x) == nearest_within(x, 0, INT16_MAX));
    PROVE(fx_arch_usat17(x) == nearest_within(x, 0, 0x1FFFF));
}

void proof_fx_saturation_bits(void)
{
    int32_t x;
    unsigned bits;
    ASSUME(WITHIN(bits, 1U, 32U));
    const int64_t end = INT64_C(1) << (bits - 1U);
    PROVE(fx_sat_bits(x, bits) == nearest_within(x, -end, end - 1));
    PROVE(fx_usat_bits(x, bits - 1U) == nearest_within(x, 0, end - 1));
}

void proof_fx_saturation_q31(void)
{
    int64_t x;
    PROVE(fx_sat_q31(x) == to_q31(x));
    PROVE(fx_arch_clip32(x) == to_q31(x));
}

void proof_fx_sums_q15(void)
{
    q15_t a, b;
    PROVE(fx_add_q15(a, b) == to_q15((int64_t)a + b));
    PROVE(fx_neg_q15(a) == to_q15(-(int64_t)a));
    PROVE(fx_abs_q15(a) == to_q15(magnitude(a)));
}

void proof_fx_sums_q31(void)
{
    q31_t a, b;
    PROVE(fx_add_q31(a, b) == to_q31((int64_t)a + b));
    PROVE(fx_sub_q31(a, b) == to_q31((int64_t)a - b));
    PROVE(fx_add2_q31(a, b) == to_q31(a + to_q31(2 * (int64_t)b)));
    PROVE(fx_neg_q31(a) == to_q31(-(int64_t)a));
    PROVE(fx_abs_q31(a) == to_q31(magnitude(a)));
}

void proof_fx_wrapping_sums(void)
{
    int32_t a, b;
    PROVE((uint32_t)fx_add_wrap(a, b) == (uint32_t)((int64_t)a + b));
    PROVE((uint32_t)fx_sub_wrap(a, b) == (uint32_t)((int64_t)a - b));
}

void proof_fx_narrowing(void)
{
    int32_t x;
    q15_t y;
    PROVE(fx_round_q15(x) == to_q15(((int64_t)x + 0x4000) >> 15));
    PROVE(fx_q15_from_q31(x) == to_q15(((int64_t)x + 0x8000) >> 16));
    PROVE(fx_q15_from_q31(fx_q31_from_q15(y)) == y);
}

void proof_fx_clamp(void)
{
    q31_t x, low, high;
    const q31_t y = fx_clamp_q31(x, low, high);
    PROVE(y <= high && (y >= low || low > high));
    PROVE(low > high || y == nearest_within(x, low, high));
    PROVE(fx_min_s32(x, low) <= x && fx_min_s32(x, low) <= low && fx_max_s32(x, low) >= x && fx_max_s32(x, low) >= low);
    q15_t x_q15, low_q15, high_q15;
    PROVE(fx_clamp_q15(x_q15, low_q15, high_q15) == fx_clamp_q31(x_q15, low_q15, high_q15));
}

void proof_fx_shift_left(void)
{
    q31_t x;
    unsigned n;
    const int64_t beyond = (x == 0) ? 0 : ((x < 0) ? INT32_MIN : INT32_MAX);
    PROVE(fx_shl_q31(x, n) == ((n > 31U) ? beyond : to_q31((int64_t)x * (INT64_C(1) << (n & 31U)))));
}

void proof_fx_shift_right(void)
{
    int32_t x;
    unsigned n;
    const int64_t half = (n == 0U || n > 32U) ? 0 : (INT64_C(1) << (n - 1U));
    PROVE(fx_shr_round(x, n) == ((n > 32U) ? 0 : (((int64_t)x + half) >> (n & 63U))));
}
