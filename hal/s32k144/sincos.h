/* SPDX-License-Identifier: Apache-2.0 */
#ifndef HAL_S32K144_SINCOS_H
#define HAL_S32K144_SINCOS_H
/** Angle of a sensor that delivers a sine and a cosine, from one 12-bit count of each.
 *   s = (count - offset)/amplitude, c alike;  valid: low <= s^2 + c^2 <= high;  angle = atan2(s, c)
 *   In the first octant atan(t)/2 pi is an odd polynomial in t = min(|s|, |c|)/max(|s|, |c|) of ninth degree; symmetry
 *   gives the others.
 * Source   README.md, sine and cosine; the polynomial is the minimax one on [0, 1], from a Remez exchange
 * Units    counts of the converters; scaled: SINCOS_ONE = the nominal amplitude; angle: fraction of a turn, 2^32 = one
 * Range    every count; sincos_angle(): both below 2^15 in magnitude
 * Rounding sincos_angle(): at most 2e-5 rad (polynomial 1.15e-5, quotient 7.6e-6), an eighth of a count's 6.1e-4 rad
 *          and less; a count is scaled with at most 1.5/16384
 * Errors   sincos_angle(0, 0) is 0 or a quarter turn: sincos_is_valid() refuses it
 * Context  fast ISR; some 40 instructions with one division, no loop */
#include <stdbool.h>
#include <stdint.h>

#include "fx/div.h"
#include "fx/q.h"

/* The sensor and its board: to be measured on each board, or taken from the sensor's data sheet. Half of the reference
 * is the middle; an amplitude of 2 V of 5 V is 1638 counts. */
#define SINE_OFFSET 2048      /* counts */
#define COSINE_OFFSET 2048    /* counts */
#define SINE_AMPLITUDE 1638   /* counts */
#define COSINE_AMPLITUDE 1638 /* counts */

/* A resolver's windings are sampled at the negative peak of their excitation (excitation.h). */
#if ANGLE_EXCITED
#define SINCOS_SIGN (-1)
#else
#define SINCOS_SIGN 1
#endif

#define SINCOS_ONE 16384
#define SINCOS_COUNTS 4096 /* of the converter */
#define SINCOS_GAIN_Q16(amplitude) (SINCOS_SIGN * (SINCOS_ONE * 65536 + (amplitude) / 2) / (amplitude))

/* The vector's length may differ from the nominal one by the amplitude's tolerance (12 %: temperature, ageing and
 * distance of a magnet, supply), a difference of the two amplitudes (3 %), both offsets (3 % each, together 4.2 %), the
 * angle between the tracks (1 degree, 0.9 %) and 4 counts of noise in each (0.4 %): 20.5 %. The band is 0.79 ... 1.21
 * of the nominal length. A track that lies at either end of the converter's range is longer by itself. */
#define SINCOS_LEAST_PERMILLE 790
#define SINCOS_GREATEST_PERMILLE 1210
#define SINCOS_SQUARE(permille) ((uint32_t)((int64_t)SINCOS_ONE * SINCOS_ONE * (permille) * (permille) / 1000000))
#define SINCOS_LOW SINCOS_SQUARE(SINCOS_LEAST_PERMILLE)
#define SINCOS_HIGH SINCOS_SQUARE(SINCOS_GREATEST_PERMILLE)

/* An open or shorted wire, which the board pulls to one end, is outside the band whatever the other track is. */
#define SINCOS_SHOWS_ENDS(offset, amplitude) \
    (1000 * (offset) > SINCOS_GREATEST_PERMILLE * (amplitude) && \
     1000 * (SINCOS_COUNTS - 1 - (offset)) > SINCOS_GREATEST_PERMILLE * (amplitude))
_Static_assert(SINCOS_SHOWS_ENDS(SINE_OFFSET, SINE_AMPLITUDE), "a broken wire of the sine would stay in the band");
_Static_assert(SINCOS_SHOWS_ENDS(COSINE_OFFSET, COSINE_AMPLITUDE), "a broken wire of the cosine would stay in it");
/* Scaled values have 15 bits and a sign: up to 1.99 of the amplitude. */
#define SINCOS_FITS(offset, amplitude) \
    (100 * (offset) < 199 * (amplitude) && 100 * (SINCOS_COUNTS - (offset)) < 199 * (amplitude))
_Static_assert(SINCOS_FITS(SINE_OFFSET, SINE_AMPLITUDE), "the sine does not fit into 15 bits");
_Static_assert(SINCOS_FITS(COSINE_OFFSET, COSINE_AMPLITUDE), "the cosine does not fit into 15 bits");

typedef struct {
    int32_t sine, cosine;
} sincos_t;

/* Q0 * Q16 = Q16, below 2^31 by the assertion above; truncated. */
static inline sincos_t sincos_scaled(uint32_t sine_count, uint32_t cosine_count)
{
    return (sincos_t){(((int32_t)sine_count - SINE_OFFSET) * SINCOS_GAIN_Q16(SINE_AMPLITUDE)) >> 16,
                      (((int32_t)cosine_count - COSINE_OFFSET) * SINCOS_GAIN_Q16(COSINE_AMPLITUDE)) >> 16};
}

static inline bool sincos_is_valid(sincos_t at)
{
    const uint32_t square = (uint32_t)(at.sine * at.sine) + (uint32_t)(at.cosine * at.cosine);
    return square - SINCOS_LOW <= SINCOS_HIGH - SINCOS_LOW;
}

/* Coefficients of t, t^3 ... t^9 in Q30, Q32 ... Q38: each product with t^2 in Q30 takes two bits away. */
static inline uint32_t sincos_octant(uint32_t least, uint32_t greatest)
{
    const uint32_t ratio_q17 = (uint32_t)fx_quotient(least << 17, greatest);
    const int32_t t = (int32_t)((ratio_q17 - (ratio_q17 >> 17)) << 14); /* 1 becomes the largest Q31 */
    const int32_t square = fx_mulhi(t, t);
    int32_t sum = fx_mulhi_add(-931358815, 911935797, square);
    sum = fx_mulhi_add(492602557, sum, square);
    sum = fx_mulhi_add(-225784882, sum, square);
    sum = fx_mulhi_add(170868476, sum, square);
    return (uint32_t)fx_mulhi(sum, t) << 3; /* Q30 * Q31 = Q29 of a turn */
}

static inline uint32_t sincos_angle(sincos_t at)
{
    const uint32_t s = (uint32_t)(at.sine < 0 ? -at.sine : at.sine);
    const uint32_t c = (uint32_t)(at.cosine < 0 ? -at.cosine : at.cosine);
    uint32_t angle = (s > c) ? 0x40000000U - sincos_octant(c, s) : sincos_octant(s, c);
    if (at.cosine < 0) {
        angle = 0x80000000U - angle;
    }
    return (at.sine < 0) ? 0U - angle : angle;
}

#endif
