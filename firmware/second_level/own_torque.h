/* SPDX-License-Identifier: Apache-2.0 */
#ifndef SECOND_LEVEL_OWN_TORQUE_H
#define SECOND_LEVEL_OWN_TORQUE_H
/** Torque from the measured currents and the measured angle, by a coarse table of the second level's own.
 *   theta_e = p theta_m + offset;  i_d = alpha cos + beta sin,  i_q = beta cos - alpha sin
 *   t = sgn(i_q) table(i_d, |i_q|)
 * Source   docs/theory/second-level.md (SL-3), (SL-4)
 * Units    per unit of T_b
 * Range    every argument; outside the table its edge
 * Rounding 2 LSB q15; the coarse table's error is part of `tolerance`
 * Errors   none
 * Context  1 kHz task */
#include "second_level/constants.h"

typedef struct {
    int32_t alpha, beta; /* current of the sample, q15 */
    uint32_t theta_m;    /* mechanical angle of the sample, 2^32 = one turn */
} second_level_sample_t;

int32_t second_level_own_torque(const second_level_constants_t *constants, const second_level_sample_t *sample);

#endif
