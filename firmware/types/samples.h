/* SPDX-License-Identifier: Apache-2.0 */
#ifndef TYPES_SAMPLES_H
#define TYPES_SAMPLES_H
/** Values exchanged with the hardware in every period: converter counts in, duties out.
 * Source   docs/architecture.md, the HAL seam
 * Units    counts of an adc_bits converter, right-aligned; duties with 2^15 = 1.0
 * Range    duties 0 ... 32768. Each value is a word, because halfwords would have to be zero-extended at every use
 * Errors   none: values only; the monitors evaluate them
 * Context  values only */
#include <stdint.h>

typedef struct {
    uint32_t i_a, i_b, i_c; /* mid scale is zero current, positive into the motor */
    uint32_t v_dc;
} adc_counts_t;

/** The part of the converter counts that the second level uses. */
typedef struct {
    uint32_t i_a, i_b, i_c;
} current_counts_t;

typedef struct {
    uint32_t a, b, c; /* 32768: upper switch on for the whole period */
} duty_t;

#endif
