/* SPDX-License-Identifier: Apache-2.0 */
#ifndef CONTROL_MEASURE_H
#define CONTROL_MEASURE_H
/** Turns one set of converter counts into phase currents and dc voltage.
 *   i_x = (count_x scale_x + bias_x) / 2^14,  v_dc = (count_v scale_v + 2^15) / 2^16
 *   with scale = gain 2^(16 - adc_bits), gain_x in Q14, gain_v in Q15, and bias_x = 2^13 - offset_x gain_x, the half
 *     of the rounding included
 * Source   docs/theory/current-control.md (CC-2), (CC-3)
 * Units    counts of an adc_bits converter, offset in counts of a 16-bit one; currents per unit of I_b, voltage per
 *          unit of V_b
 * Range    current gains (0, 2) in Q14 around 1.0; offsets 0 ... 65535, mid scale 32768; counts above adc_bits give
 *          any value in range
 * Rounding half up, 1/2 LSB q15
 * Errors   saturates; a current on its end stop is the over-current monitor's business, which trips below 80 % of it
 * Context  fast ISR; no division, no loop */
#include <stdint.h>

#include "types/frames.h"
#include "types/samples.h"

typedef struct {
    int32_t scale[3];
    int32_t bias[3];
    uint32_t v_dc_scale;
} measure_config_t;

typedef struct {
    abc_t i;
    int32_t v_dc;
} measure_t;

measure_t measure_step(const measure_config_t *config, const adc_counts_t *counts);

#endif
