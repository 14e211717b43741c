/* SPDX-License-Identifier: Apache-2.0 */
#ifndef FX_ARCH_H
#define FX_ARCH_H

/** One Cortex-M4 DSP instruction per function, or the same bits from portable C.
 *   The two halves of this header must agree bit for bit; a test runs both on the same vectors.
 * Source   docs/theory/fixed-point.md (FX-4) to (FX-8); Arm v7-M ARM, section A7.7
 * Units    raw integers; the formats are in fx/format.h and fx/q.h, the only users
 * Range    every argument; sums of multiply-accumulates wrap modulo 2^32 as the instruction does
 * Rounding *_r: half up; smulwb, smlawb: towards minus infinity
 * Errors   none
 * Context  any; one instruction each */

#include <stdint.h>

_Static_assert((-1 >> 1) == -1, "arithmetic right shift expected");

/* Wrapping sums go through uint32_t: a signed overflow would be undefined. */
static inline int32_t fx_arch_add_wrap(int32_t a, int32_t b)
{
    return (int32_t)((uint32_t)a + (uint32_t)b);
}

static inline int32_t fx_arch_sub_wrap(int32_t a, int32_t b)
{
    return (int32_t)((uint32_t)a - (uint32_t)b);
}

/* Plain C for all processors: gcc chooses MLA or SMLABB, whichever needs no sign extension. */
static inline int32_t fx_arch_smlabb(int16_t a, int16_t b, int32_t acc)
{
    return fx_arch_add_wrap(acc, (int32_t)a * b);
}

#ifdef __ARM_FEATURE_DSP
/* GCOVR_EXCL_START: instructions of the Cortex-M4, which tests/target/test_fx.py compares with the other half. */

#include <arm_acle.h>

static inline int32_t fx_arch_qadd(int32_t a, int32_t b)
{
    return __qadd(a, b);
}

static inline int32_t fx_arch_qsub(int32_t a, int32_t b)
{
    return __qsub(a, b);
}

/* The macros __ssat and __usat of gcc contain a conversion from unsigned, to which no cast can be added. */
#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Wsign-conversion"
__attribute__((always_inline)) static inline int16_t fx_arch_ssat16(int32_t x)
{
    const int32_t y = __ssat(x, 16);
    /* States the range to the compiler, which saves the SXTH after every narrowing. */
    if ((y < INT16_MIN) || (y > INT16_MAX)) {
        __builtin_unreachable();
    }
    return (int16_t)y;
}

/* The result stays in a word; with the builtin the compiler can make a shift part of the instruction. */
static inline int32_t fx_arch_ssat16_word(int32_t x)
{
    return __ssat(x, 16);
}

static inline int32_t fx_arch_usat15_word(int32_t x)
{
    return (int32_t)__usat(x, 15);
}

static inline uint32_t fx_arch_usat17(int32_t x)
{
    return (uint32_t)__usat(x, 17);
}
#pragma GCC diagnostic pop

/* The width must be a constant once everything is inlined: it is part of the instruction. */
__attribute__((always_inline)) static inline int32_t fx_arch_ssat(int32_t x, unsigned bits)
{
    int32_t y;
    __asm__("ssat %0, %1, %2" : "=r"(y) : "n"(bits), "r"(x));
    return y;
}

__attribute__((always_inline)) static inline int32_t fx_arch_usat(int32_t x, unsigned bits)
{
    int32_t y;
    __asm__("usat %0, %1, %2" : "=r"(y) : "n"(bits), "r"(x));
    return y;
}

/* A division by zero gives zero, as long as the port leaves the trap for it (CCR.DIV_0_TRP) disabled. */
static inline int32_t fx_arch_udiv(uint32_t a, uint32_t b)
{
    int32_t y;
    __asm__("udiv %0, %1, %2" : "=r"(y) : "r"(a), "r"(b));
    return y;
}

/* The builtins would make two instructions, a doubling and an addition. */
static inline int32_t fx_arch_qdadd(int32_t a, int32_t b)
{
    int32_t y;
    __asm__("qdadd %0, %1, %2" : "=r"(y) : "r"(a), "r"(b));
    return y;
}

/* Only the lower half of b counts. The builtin would first extend its sign, by another instruction. */
static inline int32_t fx_arch_smulwb(int32_t a, int32_t b)
{
    int32_t y;
    __asm__("smulwb %0, %1, %2" : "=r"(y) : "r"(a), "r"(b));
    return y;
}

static inline int32_t fx_arch_smlawb(int32_t a, int32_t b, int32_t acc)
{
    int32_t y;
    __asm__("smlawb %0, %1, %2, %3" : "=r"(y) : "r"(a), "r"(b), "r"(acc));
    return y;
}

static inline int32_t fx_arch_smmul_r(int32_t a, int32_t b)
{
    int32_t y;
    __asm__("smmulr %0, %1, %2" : "=r"(y) : "r"(a), "r"(b));
    return y;
}

static inline int32_t fx_arch_smmla_r(int32_t a, int32_t b, int32_t acc)
{
    int32_t y;
    __asm__("smmlar %0, %1, %2, %3" : "=r"(y) : "r"(a), "r"(b), "r"(acc));
    return y;
}

static inline int32_t fx_arch_smmls_r(int32_t a, int32_t b, int32_t acc)
{
    int32_t y;
    __asm__("smmlsr %0, %1, %2, %3" : "=r"(y) : "r"(a), "r"(b), "r"(acc));
    return y;
}

static inline uint32_t fx_arch_pkhbt(int32_t lo, int32_t hi)
{
    uint32_t y;
    __asm__("pkhbt %0, %1, %2, lsl #16" : "=r"(y) : "r"(lo), "r"(hi));
    return y;
}

static inline uint32_t fx_arch_pkhtb(int32_t hi, int32_t lo)
{
    uint32_t y;
    __asm__("pkhtb %0, %1, %2, asr #16" : "=r"(y) : "r"(hi), "r"(lo));
    return y;
}

static inline uint32_t fx_arch_qsub16(uint32_t a, uint32_t b)
{
    return (uint32_t)__qsub16((int16x2_t)a, (int16x2_t)b);
}

static inline int32_t fx_arch_smuad(uint32_t a, uint32_t b)
{
    return __smuad((int16x2_t)a, (int16x2_t)b);
}

static inline int32_t fx_arch_smuadx(uint32_t a, uint32_t b)
{
    return __smuadx((int16x2_t)a, (int16x2_t)b);
}

static inline int32_t fx_arch_smusd(uint32_t a, uint32_t b)
{
    return __smusd((int16x2_t)a, (int16x2_t)b);
}

static inline int32_t fx_arch_smlsdx(uint32_t a, uint32_t b, int32_t acc)
{
    return __smlsdx((int16x2_t)a, (int16x2_t)b, acc);
}

static inline int32_t fx_arch_smlad(uint32_t a, uint32_t b, int32_t acc)
{
    return __smlad((int16x2_t)a, (int16x2_t)b, acc);
}

/* GCOVR_EXCL_STOP */
#else
#include "fx/arch_portable.h"
#endif

#endif
