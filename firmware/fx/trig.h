/* SPDX-License-Identifier: Apache-2.0 */
#ifndef FX_TRIG_H
#define FX_TRIG_H

/** Sine and cosine of an angle, by rotating the nearest of 512 table points through the remaining angle.
 * Source   docs/theory/fixed-point.md (FX-16) to (FX-20)
 * Units    angles: turn / 2^16 (fx_sincos), turn / 2^32 (fx_rotation); both wrap. sin, cos: q15
 * Range    every argument
 * Rounding 3.2e-5 of full scale (32768), peaks at +1 saturate to 32767
 * Errors   none
 * Context  any; 12 instructions as a call, no division, no loop */

#include "fx/codegen.h"
#include "fx/q.h"

typedef struct {
    q15_t sin;
    q15_t cos;
} fx_sincos_t;

/* Sine and cosine of 2 pi i / 512 in Q31, plus half an LSB of q15; they lie side by side, so that one instruction loads
 * both. */
typedef struct {
    int32_t sin, cos;
} fx_point_t;

extern const fx_point_t fx_sin_table[512];

static inline fx_sincos_t fx_sincos(uint16_t angle)
{
    const uint32_t a = angle;
    const fx_point_t *point = &fx_sin_table[((a + 64U) >> 7) & 511U];
    const int32_t sin0 = point->sin;
    const int32_t cos0 = point->cos;
    /* The signed low 7 bits, -64..63, times 2 pi / 2^16 in Q32. */
    const int32_t rest = (int32_t)(a << 25) >> 25;
    const int32_t delta = rest * 411775;
    const int32_t s = fx_mulhi_add(sin0, cos0, delta);
    const int32_t c = fx_mulhi_sub(cos0, sin0, delta);
    return (fx_sincos_t){.sin = (q15_t)(s >> 16), .cos = (q15_t)(c >> 16)};
}

/* (cos, sin) in one word, low half first, for dual products: fx_sincos() of an angle that is not rounded to 16 bits. */
static inline fx_pair_t fx_rotation(uint32_t turn)
{
    const fx_point_t *point = &fx_sin_table[(turn + (1U << 22)) >> 23];
    FX_ADDRESS_ONCE(point);
    const int32_t sin0 = point->sin;
    const int32_t cos0 = point->cos;
    /* The signed low 23 bits, as a fraction of 2^32, times 2 pi / 2^9 in Q32. */
    const int32_t delta = fx_mulhi((int32_t)(turn << 9), 52707179);
    return fx_arch_pkhtb(fx_mulhi_add(sin0, cos0, delta), fx_mulhi_sub(cos0, sin0, delta));
}

/* fx_rotation(), not inlined: no interrupt uses it, and several copies would take more memory. */
fx_pair_t fx_unit_vector(uint32_t turn);

#endif
