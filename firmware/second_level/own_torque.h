/* SPDX-License-Identifier: Apache-2.0 */
#ifndef SECOND_LEVEL_OWN_TORQUE_H
#define SECOND_LEVEL_OWN_TORQUE_H
/** Torque from the converters' counts of the currents and the measured angle, by a coarse table of the second level's
 * own.
 *   i_alpha = (2 i_a - i_b - i_c)/3, i_beta = (i_b - i_c)/sqrt(3), in counts: mid scale cancels
 *   theta_e = p theta_m + offset;  i_d = i_alpha cos + i_beta sin,  i_q = i_beta cos - i_alpha sin
 *   t = sgn(i_q) (s - theta^2/12 max(2 s - mean_flux |i_q|, 0)),  s = table(i_d, |i_q|) + c
 *   c = psi_d_error |i_q| + lq_error (table - (psi_f + l_d i_d) |i_q|), -table/5 ... 0
 *   mean_flux = psi_f l_q/l_d
 *   c corrects the table by the identified deviation of magnet and q axis: only towards a smaller torque, and at most
 *   as far as a healthy machine may deviate. s is the torque at the samples; that of the shaft is the mean over the
 *   period, in which the field turns by theta; theta^2/12 counts up to a sixteenth. The torque has the sign of i_q
 * Source   docs/theory/second-level.md (SL-3), (SL-4), (SL-8), (SL-9)
 * Units    per unit of T_b
 * Range    every argument; outside the table its edge
 * Rounding 3 LSB q15, a current 1; the coarse table's error is part of `tolerance`
 * Errors   none
 * Context  1 kHz task */
#include "second_level/constants.h"
#include "types/samples.h"

typedef struct {
    current_counts_t counts;
    uint32_t theta_m;    /* mechanical angle of the same instant, 2^32 = one turn */
    int32_t psi_d_error; /* identified psi_d minus the tables', q15 */
    int32_t lq_error;    /* identified scale of psi_q minus one, q15 */
} second_level_sample_t;

/* turn: change of theta_m in the last step. */
int32_t second_level_own_torque(const second_level_constants_t *constants, const second_level_sample_t *sample,
                                int32_t turn);

#endif
