/* SPDX-License-Identifier: Apache-2.0 */
#ifndef CONTROL_MEASURE_H
#define CONTROL_MEASURE_H
/** Turns one set of converter counts into the current vector, the sum of the phases and the dc voltage.
 *   i_x = count_x scale_x + bias_x;  alpha = (2 i_a - i_b - i_c)/3, beta = (i_b - i_c)/sqrt(3), sum = i_a + i_b + i_c
 *   v_dc = (count_v v_dc_scale + 2^14) / 2^15
 *   with scale_x = gain_x 2^12 2^(16 - adc_bits), bias_x = -offset_x gain_x 2^12, v_dc_scale = gain_v 2^(30 - adc_bits)
 * Source   docs/theory/current-control.md (CC-1) ... (CC-3)
 * Units    counts of an adc_bits converter, offset in counts of a 16-bit one; currents per unit of I_b, voltage per
 *          unit of V_b
 * Range    gains (0, 2) around 1.0; offsets 0 ... 65535, mid scale 32768; counts above adc_bits give any value in
 *          range; phases are carried in Q27, +-16
 * Rounding half up once, 1/2 LSB q15, in alpha, beta and v_dc; none in the sum
 * Errors   saturates; a phase on its end stop is the over-current monitor's business, which trips below 80 % of it
 * Context  fast ISR; no division, no loop */
#include <stdint.h>

#include "types/frames.h"
#include "types/samples.h"

typedef struct {
    struct {
        int32_t scale, bias;
    } phase[3];
    uint32_t v_dc_scale;
} measure_config_t;

typedef struct {
    ab_t i;
    int32_t sum_q27; /* of the phases: zero but for errors of the sensors */
    int32_t v_dc;    /* 0 ... Q15_MAX */
} measure_t;

measure_t measure_step(const measure_config_t *config, const adc_counts_t *counts);

/** Back to the phases, q15, from (alpha, beta) and the sum, for those who look closer: within 2.2 LSB while |alpha|,
 * |beta| < 1. */
abc_t measure_phases(fx_pair_t i, int32_t sum_q27);

#endif
