/* SPDX-License-Identifier: Apache-2.0 */
#ifndef TYPES_IDENTIFICATION_H
#define TYPES_IDENTIFICATION_H
/** Result of the identification, in the same form for both laws.
 *   psi_delta  magnet flux minus the tables';  r_delta  resistance minus that at 20 C
 *   psi_d_error  d-axis flux minus the tables' at the present current: what current control feeds forward
 *   torque_estimated  air-gap torque, mean over the last step;  torque_variance_q30  of it
 *   iron_admittance  a of (CR-18), current of the iron loss per flux linkage, which the references contain; nominal
 *     until recalled values have been confirmed
 *   lq_error  scale of psi_q minus one, which the torque path adds to the tables
 *   The other values that act on the torque (psi_d_error, lq_error, confidence) are 0 until recalled values have been
 *   confirmed (drive/recall.h). The paper's law identifies psi_delta and r_delta only and assumes that the tables are
 *   right: lq_error and iron_admittance are 0, psi_d_error is psi_delta, and the confidence is 1 although no variance
 *   is known.
 * Source   docs/theory/identification.md (ID-15) ... (ID-18), current-reference.md (CR-18), mrai.md
 * Units    per unit of the bases in types/bases.h
 * Range    confidence and qualities 0 ... 1; torque_variance_q30 Q30, Q31_MAX: the law does not state one
 * Errors   clamped: the parameter is at its limit, and the limit is what is reported
 * Context  written by the 1 kHz task once per step */
#include <stdbool.h>

#include "fx/q.h"

typedef struct {
    q31_t psi_delta, r_delta;
    q31_t lq_error;
    q31_t iron_admittance;
    int32_t torque_variance_q30;
    q15_t psi_d_error;
    q15_t torque_estimated;
    q15_t confidence;
    q15_t psi_quality, r_quality;
    bool psi_clamped, r_clamped;
} identification_t;

#endif
