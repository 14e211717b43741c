/* SPDX-License-Identifier: Apache-2.0 */
#ifndef HAL_S32K144_SINCOS_H
#define HAL_S32K144_SINCOS_H
/** Angle of a sensor that delivers a sine and a cosine, from one 12-bit count of each.
 *   s = (count - offset)/amplitude, c alike;  valid: low <= s^2 + c^2 <= high;  angle = atan2(s, c)
 *   A track that stays: one has changed by at most w since an earlier sample, the point, and the other one by M:
 *   invalid if |s^2 + c^2 - (s^2 + c^2 of the point)| > K M + N; where both have changed by more, the sample is the
 *   next point
 *   In the first octant atan(t)/2 pi is an odd polynomial in t = min(|s|, |c|)/max(|s|, |c|) of ninth degree; symmetry
 *   gives the others.
 * Source   README.md, sine and cosine; docs/theory/monitors.md (MN-54), (MN-55); the polynomial is the minimax one on
 *          [0, 1], from a Remez exchange
 * Units    counts of the converters; scaled: SINCOS_ONE = the nominal amplitude; angle: fraction of a turn, 2^32 = one
 * Range    every count; sincos_angle(): both below 2^15 in magnitude
 * Rounding sincos_angle(): at most 2e-5 rad (polynomial 1.15e-5, quotient 7.6e-6), an eighth of a count's 6.1e-4 rad
 *          and less; a count is scaled with at most 1.5/16384
 * Errors   sincos_angle(0, 0) is 0 or a quarter turn: sincos_is_valid() refuses it
 * Context  fast ISR; some 60 instructions with one division, no loop */
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

/* A track that stays. w: 8 counts, the noise of two samples. K: between two points that are M apart the square of the
 * length differs by the offsets' 2 * 0.042 M, and by the difference of the amplitudes (3 %) and the angle between the
 * tracks (1 degree), together sqrt(0.03^2 + 0.0175^2), times 2 * 1.12/0.98 M: 0.164 M. N: the noise of both samples,
 * 2 * 1.21 * 0.0035 each, and its share K of M, make 0.018; the rest up to 0.03 is for the rounding and for an
 * amplitude that changes by 0.5 % at once. */
#define SINCOS_STILL (8 * SINCOS_ONE / 1638 + 2)                              /* w and the rounding of both samples */
#define SINCOS_SHARE (17 * SINCOS_ONE / 100)                                  /* K, Q14 */
#define SINCOS_CHANGE ((int32_t)(3 * (int64_t)SINCOS_ONE * SINCOS_ONE / 100)) /* N, Q28 */
#define SINCOS_FOLLOW 64U /* samples in which the point moves by 1/16384 towards the present one */

typedef struct {
    int32_t sine, cosine;
} sincos_t;

/** The point with which later samples are compared; all zero before the first one. */
typedef struct {
    int16_t sine, cosine;
    uint8_t agreed; /* samples that have agreed with it, modulo SINCOS_FOLLOW */
    bool confirmed; /* one has: it was no disturbed sample */
} sincos_point_t;

/* Q0 * Q16 = Q16, below 2^31 by the assertion above; truncated. */
static inline sincos_t sincos_scaled(uint32_t sine_count, uint32_t cosine_count)
{
    return (sincos_t){(((int32_t)sine_count - SINE_OFFSET) * SINCOS_GAIN_Q16(SINE_AMPLITUDE)) >> 16,
                      (((int32_t)cosine_count - COSINE_OFFSET) * SINCOS_GAIN_Q16(COSINE_AMPLITUDE)) >> 16};
}

static inline uint32_t sincos_square(int32_t sine, int32_t cosine)
{
    return (uint32_t)(sine * sine) + (uint32_t)(cosine * cosine);
}

static inline bool sincos_is_valid(sincos_t at)
{
    return sincos_square(at.sine, at.cosine) - SINCOS_LOW <= SINCOS_HIGH - SINCOS_LOW;
}

static inline int32_t sincos_distance(int32_t to, int32_t from)
{
    return (to > from) ? to - from : from - to;
}

static inline int32_t sincos_towards(int32_t to, int32_t from)
{
    return (to > from) ? 1 : ((to < from) ? -1 : 0);
}

static inline void sincos_point_take(sincos_point_t *point, sincos_t at)
{
    *point = (sincos_point_t){.sine = (int16_t)at.sine, .cosine = (int16_t)at.cosine};
}

/* A slow change of the amplitude is followed. */
static inline void sincos_point_follow(sincos_point_t *point, sincos_t at)
{
    point->agreed = (uint8_t)((point->agreed + 1U) % SINCOS_FOLLOW);
    if (point->agreed == 0U) {
        point->sine = (int16_t)(point->sine + sincos_towards(at.sine, point->sine));
        point->cosine = (int16_t)(point->cosine + sincos_towards(at.cosine, point->cosine));
    }
}

/** False if one track stays although the other one moves as it cannot alone; `at` must be valid. */
static inline bool sincos_both_move(sincos_point_t *point, sincos_t at)
{
    const int32_t sine = sincos_distance(at.sine, point->sine), cosine = sincos_distance(at.cosine, point->cosine);
    if (sine > SINCOS_STILL && cosine > SINCOS_STILL) {
        sincos_point_take(point, at);
        return true;
    }
    const int32_t change =
        fx_abs_q31((int32_t)(sincos_square(at.sine, at.cosine) - sincos_square(point->sine, point->cosine)));
    if (!point->confirmed && change > SINCOS_CHANGE / 2) {
        sincos_point_take(point, at); /* one of both was disturbed */
        return true;
    }
    point->confirmed = true;
    if (change > ((sine > cosine) ? sine : cosine) * SINCOS_SHARE + SINCOS_CHANGE) {
        return false;
    }
    sincos_point_follow(point, at);
    return true;
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
