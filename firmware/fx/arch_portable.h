/* SPDX-License-Identifier: Apache-2.0 */
#ifndef FX_ARCH_PORTABLE_H
#define FX_ARCH_PORTABLE_H

/** Portable C with the results of the instructions of fx/arch.h, bit for bit.
 *   Included by fx/arch.h only, for processors without the DSP extension and for the host.
 * Source   docs/theory/fixed-point.md (FX-4) to (FX-8)
 * Units, Range, Rounding, Errors, Context: as fx/arch.h; no undefined behaviour for any argument */

#include <stdint.h>

static inline int32_t fx_arch_clip32(int64_t x)
{
    const int64_t low = (x < INT32_MIN) ? INT32_MIN : x;
    return (int32_t)((low > INT32_MAX) ? INT32_MAX : low);
}

static inline int32_t fx_arch_qadd(int32_t a, int32_t b)
{
    return fx_arch_clip32((int64_t)a + b);
}

static inline int32_t fx_arch_qsub(int32_t a, int32_t b)
{
    return fx_arch_clip32((int64_t)a - b);
}

static inline int16_t fx_arch_ssat16(int32_t x)
{
    const int32_t low = (x < INT16_MIN) ? INT16_MIN : x;
    return (int16_t)((low > INT16_MAX) ? INT16_MAX : low);
}

static inline int32_t fx_arch_ssat(int32_t x, unsigned bits)
{
    const int32_t high = (int32_t)((UINT32_C(1) << (bits - 1U)) - 1U);
    const int32_t low = (x < -high - 1) ? (-high - 1) : x;
    return (low > high) ? high : low;
}

static inline int32_t fx_arch_usat(int32_t x, unsigned bits)
{
    const int32_t high = (int32_t)((UINT32_C(1) << bits) - 1U);
    const int32_t low = (x < 0) ? 0 : x;
    return (low > high) ? high : low;
}

static inline int32_t fx_arch_udiv(uint32_t a, uint32_t b)
{
    return (int32_t)((b == 0U) ? 0U : a / b);
}

static inline int32_t fx_arch_qdadd(int32_t a, int32_t b)
{
    return fx_arch_qadd(a, fx_arch_qadd(b, b));
}

static inline int32_t fx_arch_ssat16_word(int32_t x)
{
    return fx_arch_ssat16(x);
}

static inline int32_t fx_arch_usat15_word(int32_t x)
{
    const int32_t low = (x < 0) ? 0 : x;
    return (low > INT16_MAX) ? INT16_MAX : low;
}

static inline uint32_t fx_arch_usat17(int32_t x)
{
    const int32_t low = (x < 0) ? 0 : x;
    return (uint32_t)((low > 0x1FFFF) ? 0x1FFFF : low);
}

static inline int32_t fx_arch_smulwb(int32_t a, int32_t b)
{
    return (int32_t)(((int64_t)a * (int16_t)((uint32_t)b & 0xFFFFU)) >> 16);
}

static inline int32_t fx_arch_smlawb(int32_t a, int32_t b, int32_t acc)
{
    return fx_arch_add_wrap(acc, fx_arch_smulwb(a, b));
}

static inline int32_t fx_arch_smmul_r(int32_t a, int32_t b)
{
    return (int32_t)(((int64_t)a * b + INT64_C(0x80000000)) >> 32);
}

static inline int32_t fx_arch_smmla_r(int32_t a, int32_t b, int32_t acc)
{
    return fx_arch_add_wrap(acc, fx_arch_smmul_r(a, b));
}

/* Not acc - smmul_r: the instruction rounds after the subtraction, so ties go the other way. */
static inline int32_t fx_arch_smmls_r(int32_t a, int32_t b, int32_t acc)
{
    return fx_arch_add_wrap(acc, (int32_t)((INT64_C(0x80000000) - (int64_t)a * b) >> 32));
}

static inline uint32_t fx_arch_pkhbt(int32_t lo, int32_t hi)
{
    return ((uint32_t)lo & 0xFFFFU) | ((uint32_t)hi << 16);
}

/* The upper halves of both words. */
static inline uint32_t fx_arch_pkhtb(int32_t hi, int32_t lo)
{
    return ((uint32_t)hi & 0xFFFF0000U) | ((uint32_t)lo >> 16);
}

/* Each half saturates by itself. */
static inline uint32_t fx_arch_qsub16(uint32_t a, uint32_t b)
{
    const int16_t low = fx_arch_ssat16((int32_t)(int16_t)(a & 0xFFFFU) - (int16_t)(b & 0xFFFFU));
    const int16_t high = fx_arch_ssat16((int32_t)(int16_t)(a >> 16) - (int16_t)(b >> 16));
    return fx_arch_pkhbt(low, high);
}

static inline int32_t fx_arch_smlad(uint32_t a, uint32_t b, int32_t acc)
{
    const int32_t low = (int32_t)(int16_t)(a & 0xFFFFU) * (int16_t)(b & 0xFFFFU);
    const int32_t high = (int32_t)(int16_t)(a >> 16) * (int16_t)(b >> 16);
    return fx_arch_add_wrap(acc, fx_arch_add_wrap(low, high));
}

static inline int32_t fx_arch_smuad(uint32_t a, uint32_t b)
{
    return fx_arch_smlad(a, b, 0);
}

/* a.lo b.hi + a.hi b.lo */
static inline int32_t fx_arch_smuadx(uint32_t a, uint32_t b)
{
    return fx_arch_smuad(a, (b >> 16) | (b << 16));
}

/* a.lo b.lo - a.hi b.hi */
static inline int32_t fx_arch_smusd(uint32_t a, uint32_t b)
{
    const int32_t low = (int32_t)(int16_t)(a & 0xFFFFU) * (int16_t)(b & 0xFFFFU);
    const int32_t high = (int32_t)(int16_t)(a >> 16) * (int16_t)(b >> 16);
    return low - high; /* at most 2^31 - 2^15 apart */
}

/* acc + a.lo b.hi - a.hi b.lo */
static inline int32_t fx_arch_smlsdx(uint32_t a, uint32_t b, int32_t acc)
{
    return fx_arch_add_wrap(acc, fx_arch_smusd(a, (b >> 16) | (b << 16)));
}

#endif
