/* SPDX-License-Identifier: Apache-2.0 */
#ifndef CURRENT_MEASURE_H
#define CURRENT_MEASURE_H
/** Turns one set of converter counts into the current vector (Clarke transform), its zero sequence and the dc voltage.
 *   alpha = (2 i_a - i_b - i_c)/3, beta = (i_b - i_c)/sqrt(3), zero = (i_a + i_b + i_c)/3
 *   Computed from a third of each phase current, with the sign of b and c inverted, so that alpha is a sum:
 *     i_a/3, -i_b/3, -i_c/3, v_dc = count scale + bias
 *     scale = +-gain 2^13 2^(16 - adc_bits)/3, bias = -+offset gain 2^13/3; phase a's bias also holds a quarter of an
 *     LSB of alpha, which rounds alpha half up
 *     v_dc: scale = gain 2^(30 - adc_bits), bias = 2^14 - offset 2^30, the offset per unit of V_b
 * Source   docs/theory/current-control.md (CC-1) ... (CC-3)
 * Units    counts of an adc_bits converter, offset in counts of a 16-bit one; currents per unit of I_b, voltage per
 *          unit of V_b
 * Range    gains (0, 2) around 1.0; offsets 0 ... 65535, mid scale 32768; counts above adc_bits give any value in
 *          range, with each phase below 4
 * Rounding half up once, 1/2 LSB q15, in alpha, beta and v_dc; a third of a gain to 1/3 2^-13 2^(adc_bits - 16)
 * Errors   saturates, the dc voltage also at 0; a phase at full scale is detected by the over-current monitor, which
 *          trips below 80 % of it
 * Context  fast ISR; no division, no loop */
#include <stdint.h>

#include "fx/format.h"
#include "types/frames.h"
#include "types/samples.h"

typedef struct {
    int32_t scale, bias;
} measure_line_t;

typedef struct {
    measure_line_t phase[3], v_dc;
} measure_config_t;

typedef struct {
    ab_q15_t i;
    int32_t zero_q28; /* mean of the phases plus a quarter LSB of q15; only sensor errors make it differ from that */
    int32_t v_dc;     /* 0 ... Q15_MAX */
} measure_t;

/** Unsigned arithmetic: a count beyond the converter's width wraps instead of being undefined. */
static inline int32_t measure_line(const measure_line_t *line, uint32_t count)
{
    return (int32_t)(count * (uint32_t)line->scale + (uint32_t)line->bias);
}

/** (CC-3), 0 ... Q15_MAX: the one conversion of the dc voltage, also of the first sample after a reset. */
static inline int32_t measure_v_dc(const measure_line_t *line, uint32_t count)
{
    return fx_usat_q15_word(measure_line(line, count) >> 15);
}

measure_t measure_step(const measure_config_t *config, const adc_counts_t *counts);

/** Phase currents from (alpha, beta) in one word and the zero sequence, for the monitors: within 2.2 LSB while |alpha|,
 * |beta| < 1. */
abc_q15_t measure_phases(fx_pair_t i, int32_t zero_q28);

#endif
