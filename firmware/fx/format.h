/* SPDX-License-Identifier: Apache-2.0 */
#ifndef FX_FORMAT_H
#define FX_FORMAT_H

/** Fixed-point formats: constants, saturation, addition, narrowing, shifts, limits.
 *   value = integer / 2^15 (q15), / 2^31 (q31), / 2^16 (q16: a gain). Other folders include fx/q.h.
 * Source   docs/theory/fixed-point.md (FX-1) to (FX-3), (FX-9)
 * Units    q15, q31: per unit, [-1, 1); q16: gain, [-32768, 32768)
 * Range    every argument of every function, unless its comment says otherwise
 * Rounding half up (towards plus infinity); saturation to the nearest end of the format
 * Errors   none: saturation is the defined result, detect it by comparison where it matters
 * Context  any; 1 to 4 instructions each, no loop, no division. Functions that are not inline are not used in a settled
 *          period; one copy of them takes less memory than many */

#include <stdint.h>

#include "fx/arch.h"

typedef int16_t q15_t;
typedef int32_t q31_t;
typedef int32_t q16_t;

#define Q15_MAX ((q15_t)INT16_MAX)
#define Q15_MIN ((q15_t)INT16_MIN)
#define Q31_MAX ((q31_t)INT32_MAX)
#define Q31_MIN ((q31_t)INT32_MIN)
#define Q16_ONE ((q16_t)65536)

/* For compile-time constants only: rounded half away from zero, saturated. With a variable argument the firmware would
 * compute in floating point at run time. */
#define FX_CONST(x, one, lo, hi) \
    (((x) * (one) >= (hi)) ? (hi) \
     : ((x) * (one) <= (lo)) ? (lo) \
                             : ((x) * (one) + (((x) < 0.0) ? -0.5 : 0.5)))
#define Q15(x) ((q15_t)FX_CONST((double)(x), 32768.0, -32768.0, 32767.0))
#define Q31(x) ((q31_t)FX_CONST((double)(x), 2147483648.0, -2147483648.0, 2147483647.0))
#define Q16(x) ((q16_t)FX_CONST((double)(x), 65536.0, -2147483648.0, 2147483647.0))

#define SQRT3_HALF 0.86602540378443865 /* sqrt(3)/2, for Q15(), Q16() and Q31() */

__attribute__((always_inline)) static inline q15_t fx_sat_q15(int32_t x)
{
    return fx_arch_ssat16(x);
}

/* As fx_sat_q15(), with the result in a word, so that its next use needs no sign extension. */
static inline int32_t fx_sat_q15_word(int32_t x)
{
    return fx_arch_ssat16_word(x);
}

/* Into [0, Q15_MAX]: a negative number becomes 0. */
static inline int32_t fx_usat_q15_word(int32_t x)
{
    return fx_arch_usat15_word(x);
}

/* Into [-2^(bits-1), 2^(bits-1) - 1]; bits is a constant of 1 to 32. */
__attribute__((always_inline)) static inline int32_t fx_sat_bits(int32_t x, unsigned bits)
{
    return fx_arch_ssat(x, bits);
}

/* Into [0, 2^bits - 1]; bits is a constant of 0 to 31. */
__attribute__((always_inline)) static inline int32_t fx_usat_bits(int32_t x, unsigned bits)
{
    return fx_arch_usat(x, bits);
}

q31_t fx_sat_q31(int64_t x);

static inline q15_t fx_add_q15(q15_t a, q15_t b)
{
    return fx_sat_q15((int32_t)a + b);
}

static inline q15_t fx_neg_q15(q15_t a)
{
    return fx_sat_q15(-(int32_t)a);
}

/* Of a q15 number, which may come in a word: no sign extension is needed. */
q15_t fx_abs_q15(int32_t a);

/* Modulo 2^32, without undefined behaviour. */
static inline int32_t fx_add_wrap(int32_t a, int32_t b)
{
    return fx_arch_add_wrap(a, b);
}

static inline int32_t fx_sub_wrap(int32_t a, int32_t b)
{
    return fx_arch_sub_wrap(a, b);
}

static inline q31_t fx_add_q31(q31_t a, q31_t b)
{
    return fx_arch_qadd(a, b);
}

static inline q31_t fx_sub_q31(q31_t a, q31_t b)
{
    return fx_arch_qsub(a, b);
}

/* a + 2 b, both steps saturating. */
static inline q31_t fx_add2_q31(q31_t a, q31_t b)
{
    return fx_arch_qdadd(a, b);
}

static inline q31_t fx_neg_q31(q31_t a)
{
    return fx_arch_qsub(0, a);
}

q31_t fx_abs_q31(q31_t a);

/* Magnitude by the ones' complement: that of a negative number is one LSB too small, and none saturates. */
static inline int32_t fx_ones_magnitude(int32_t x)
{
    return x ^ (x >> 31);
}

/* Narrows a Q30 accumulator. The rounding half is added with saturation, so that every int32_t is allowed: the caller
 * has to show only that its sum stays in -2 ... 2 per unit. */
static inline int32_t fx_round_q15_word(int32_t q30)
{
    return fx_sat_q15_word(fx_arch_qadd(q30, 0x4000) >> 15);
}

static inline q15_t fx_round_q15(int32_t q30)
{
    return (q15_t)fx_round_q15_word(q30);
}

q15_t fx_q15_from_q31(q31_t x);

static inline q31_t fx_q31_from_q15(q15_t x)
{
    return (q31_t)x * 65536;
}

/* Zero bits above the highest one; x > 0. */
static inline unsigned fx_leading_zeros(uint32_t x)
{
    return (unsigned)__builtin_clz(x);
}

static inline int32_t fx_min_s32(int32_t a, int32_t b)
{
    return (a < b) ? a : b;
}

static inline int32_t fx_max_s32(int32_t a, int32_t b)
{
    return (a > b) ? a : b;
}

/* Limits x to [lo, hi]; the result is hi if the caller passes lo > hi. */
static inline q31_t fx_clamp_q31(q31_t x, q31_t lo, q31_t hi)
{
    return fx_min_s32(fx_max_s32(x, lo), hi);
}

static inline q15_t fx_clamp_q15(q15_t x, q15_t lo, q15_t hi)
{
    return (q15_t)fx_clamp_q31(x, lo, hi);
}

/* x * 2^n, saturated; every n is defined (beyond 31 only 0 stays in range). */
q31_t fx_shl_q31(q31_t x, unsigned n);

/* x / 2^n, half up. The highest bit that is shifted out is added after the shift; adding a half before it could
 * overflow. */
static inline int32_t fx_shr_round(int32_t x, unsigned n)
{
    if ((n == 0U) || (n > 31U)) {
        return (n == 0U) ? x : 0; /* |x| / 2^32 <= 1/2, and -1/2 rounds up to 0 */
    }
    return (x >> n) + ((x >> (n - 1U)) & 1);
}

#endif
