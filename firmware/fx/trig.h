/* SPDX-License-Identifier: Apache-2.0 */
#ifndef FX_TRIG_H
#define FX_TRIG_H

/** Sine and cosine of an angle; angle of a vector.
 *   (sin, cos)(a) by rotating the nearest of 512 table points through the remaining angle.
 *   atan2: signed ratio of the smaller to the larger component, table of atan, nearest axis added.
 * Source   docs/theory/fixed-point.md (FX-18) to (FX-25)
 * Units    angles: turn / 2^16 (fx_sincos), turn / 2^32 (fx_rotation, fx_atan2); all wrap. sin, cos: q15
 * Range    every argument; atan2(0, 0) = 0
 * Rounding sin, cos: 3.2e-5 of full scale (32768), peaks at +1 saturate to 32767
 *          atan2: 2.1e-5 rad, of the angle of the integer pair, for every pair but (0, 0)
 * Errors   none
 * Context  any; 12 (sincos), 20 (atan2) instructions as a call; atan2 has one divide */

#include <stdbool.h>

#include "fx/q.h"

typedef struct {
    q15_t sin;
    q15_t cos;
} fx_sincos_t;

typedef struct {
    uint32_t base;  /* atan at the cell's start, turn / 2^32 */
    uint32_t slope; /* per 2^-16 of the ratio */
} fx_atan_cell_t;

/* Of 2 pi i / 512, Q31, plus half an LSB of q15; side by side, so that one instruction loads both. */
typedef struct {
    int32_t sin, cos;
} fx_point_t;

extern const fx_point_t fx_sin_table[512];
extern const fx_atan_cell_t fx_atan_table[257];

static inline fx_sincos_t fx_sincos(uint16_t angle)
{
    const uint32_t a = angle;
    const fx_point_t *point = &fx_sin_table[((a + 64U) >> 7) & 511U];
    __asm__("" : "+r"(point));
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
    __asm__("" : "+r"(point)); /* the address once, not as an index for each */
    const int32_t sin0 = point->sin;
    const int32_t cos0 = point->cos;
    /* The signed low 23 bits, as a fraction of 2^32, times 2 pi / 2^9 in Q32. */
    const int32_t delta = fx_mulhi((int32_t)(turn << 9), 52707179);
    return fx_arch_pkhtb(fx_mulhi_add(sin0, cos0, delta), fx_mulhi_sub(cos0, sin0, delta));
}

static inline uint32_t fx_atan2(q15_t y, q15_t x)
{
    const bool steep = fx_mul_q30(y, y) > fx_mul_q30(x, x);
    const int32_t num = steep ? x : y;
    const int32_t den = steep ? y : x;
    if (den == 0) {
        return 0U;
    }
    /* The axis nearest to the vector: 0, 1/4, 1/2 or 3/4 turn. */
    const uint32_t half = (uint32_t)den & UINT32_C(0x80000000);
    const uint32_t axis = steep ? (half | UINT32_C(0x40000000)) : half;
    /* Q16, -1..1 inclusive; |num| <= |den|, so neither the shift nor the quotient overflows. */
    const int32_t ratio = (num * 65536) / den;
    const fx_atan_cell_t cell = fx_atan_table[(ratio >> 9) + 128];
    const uint32_t angle = cell.base + (cell.slope * ((uint32_t)ratio & 511U));
    return steep ? (axis - angle) : (axis + angle);
}

#endif
