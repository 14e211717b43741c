/* SPDX-License-Identifier: Apache-2.0 */
#ifndef CONTROL_MEASURE_H
#define CONTROL_MEASURE_H
/** Turns one set of converter counts into phase currents and dc voltage.
 *   i_x = (count_x 2^shift - offset_x) gain_x / 2^14,  v_dc = count_v 2^shift gain_v / 2^16
 * Source   docs/theory/current-control.md (CC-2), (CC-3)
 * Units    counts of an adc_bits converter, left-aligned to 16 bits by shift; currents per unit of I_b, voltage per unit of V_b
 * Range    current gains (0, 2) in Q14 around 1.0; offsets in 16-bit counts around mid scale 32768
 * Rounding half up, 1/2 LSB q15
 * Errors   saturates; a current on its end stop is the over-current monitor's business, which trips below 80 % of it
 * Context  fast ISR; no division, no loop */
#include <stdint.h>

#include "types/frames.h"
#include "types/samples.h"

typedef struct {
    uint8_t shift;          /* 16 - adc_bits */
    int32_t offset[3];      /* 16-bit counts at zero current */
    int16_t gain_q14[3];    /* per-phase correction, 1.0 = 16384 */
    uint16_t v_dc_gain_q15; /* full scale of the voltage measurement in V_b, 1.0 = 32768 */
} measure_config_t;

typedef struct {
    abc_t i;
    q15_t v_dc;
} measure_t;

measure_t measure_step(const measure_config_t *config, const adc_counts_t *counts);

#endif
