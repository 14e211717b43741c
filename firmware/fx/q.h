/* SPDX-License-Identifier: Apache-2.0 */
#ifndef FX_Q_H
#define FX_Q_H

/** The fixed-point formats (fx/format.h) and their products: exact, rounded, accumulated, dual.
 *   The comment of each product adds up the formats. Sums are narrowed once, at the end, with fx_round_q15().
 * Source   docs/theory/fixed-point.md (FX-4) to (FX-8)
 * Units    per unit; gains in q16
 * Range    every argument, except that the multiply-accumulates (mac, mulhi_add, mulhi_sub, dot2)
 *          wrap modulo 2^32: the caller proves that its sum stays inside int32_t
 * Rounding half up, 1/2 LSB of the result; fx_mul_q31_word and fx_mac_q31_word truncate towards minus
 *          infinity (bias 1/2 LSB of Q30). An integrator would accumulate this bias: use them for one only where it
 *          acts for a short time, as the anti-windup of control/current/current_control.c does while the voltage is
 *          limited
 * Errors   none
 * Context  any; 1 to 3 instructions, fx_mul_q15 5, fx_mul_q31 9, fx_mul_gain_q31 12 */

#include "fx/format.h"

/* Two q15 values in one word, low half first, as they lie in memory. */
typedef uint32_t fx_pair_t;

/* Q15 * Q15 = Q30, exact: |-1 * -1| = 2^30 fits. */
static inline int32_t fx_mul_q30(q15_t a, q15_t b)
{
    return (int32_t)a * b;
}

/* acc + Q15 * Q15, Q30. */
static inline int32_t fx_mac_q30(int32_t acc, q15_t a, q15_t b)
{
    return fx_arch_smlabb(a, b, acc);
}

/* Q15 * Q15 = Q30 -> Q15; only -1 * -1 saturates. 2^30 + 2^14 cannot overflow. Only the lower halves of a and b count.
 * Not inlined: no settled period uses it. */
q15_t fx_mul_q15(int32_t a, int32_t b);

/* (a * b) / 2^32, half up: Q31 * Q31 = Q30, Q16 * Q31 = Q15, Q16 * Q16 = Q0. */
static inline int32_t fx_mulhi(int32_t a, int32_t b)
{
    return fx_arch_smmul_r(a, b);
}

/* acc + (a * b) / 2^32, half up. */
static inline int32_t fx_mulhi_add(int32_t acc, int32_t a, int32_t b)
{
    return fx_arch_smmla_r(a, b, acc);
}

/* acc - (a * b) / 2^32, half up after the subtraction. */
static inline int32_t fx_mulhi_sub(int32_t acc, int32_t a, int32_t b)
{
    return fx_arch_smmls_r(a, b, acc);
}

/* Q31 * Q31 = Q62 -> Q31; only -1 * -1 saturates. Not inlined, like fx_mul_gain_q31(): no interrupt uses them. */
q31_t fx_mul_q31(q31_t a, q31_t b);

/* Q31 * Q15 = Q46 -> Q30, truncated; only the lower half of b counts. */
static inline int32_t fx_mul_q31_word(q31_t a, int32_t b)
{
    return fx_arch_smulwb(a, b);
}

/* acc + Q31 * Q15, Q30, truncated; b as in fx_mul_q31_word(). */
static inline int32_t fx_mac_q31_word(int32_t acc, q31_t a, int32_t b)
{
    return fx_arch_smlawb(a, b, acc);
}

/* Q16 * Q15 = Q31 -> Q15. Shifting x up by 16 lets SMMULR round: (g x 2^16 + 2^31) / 2^32. */
static inline int32_t fx_mul_gain_q15_word(q16_t gain, int32_t x)
{
    return fx_sat_q15_word(fx_mulhi(gain, x * 65536));
}

static inline q15_t fx_mul_gain_q15(q16_t gain, q15_t x)
{
    return (q15_t)fx_mul_gain_q15_word(gain, x);
}

/* Q16 * Q31 = Q47 -> Q31. */
q31_t fx_mul_gain_q31(q16_t gain, q31_t x);

/* The lower halves of two words as a pair; their upper halves do not count. */
static inline fx_pair_t fx_pair(int32_t lo, int32_t hi)
{
    return fx_arch_pkhbt(lo, hi);
}

/* The differences of the halves, each saturated. */
static inline fx_pair_t fx_pair_sub(fx_pair_t a, fx_pair_t b)
{
    return fx_arch_qsub16(a, b);
}

/* a.lo * b.lo + a.hi * b.hi, Q30; wraps only when all four are -1. */
static inline int32_t fx_dot2(fx_pair_t a, fx_pair_t b)
{
    return fx_arch_smuad(a, b);
}

/* acc + a.lo * b.lo + a.hi * b.hi, Q30. */
static inline int32_t fx_dot2_acc(int32_t acc, fx_pair_t a, fx_pair_t b)
{
    return fx_arch_smlad(a, b, acc);
}

/* a.lo * b.hi + a.hi * b.lo, Q30; wraps only when all four are -1. */
static inline int32_t fx_dot2_cross(fx_pair_t a, fx_pair_t b)
{
    return fx_arch_smuadx(a, b);
}

/* a.lo * b.lo - a.hi * b.hi, Q30. */
static inline int32_t fx_difference2(fx_pair_t a, fx_pair_t b)
{
    return fx_arch_smusd(a, b);
}

/* acc + a.lo * b.hi - a.hi * b.lo, Q30. */
static inline int32_t fx_difference2_cross_acc(int32_t acc, fx_pair_t a, fx_pair_t b)
{
    return fx_arch_smlsdx(a, b, acc);
}

#endif
