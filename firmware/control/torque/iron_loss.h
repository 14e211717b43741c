/* SPDX-License-Identifier: Apache-2.0 */
#ifndef TORQUE_IRON_LOSS_H
#define TORQUE_IRON_LOSS_H
/** Adds the current that supplies the iron loss to the references, which are those of the magnetising current.
 *   i_d = i_d - a psi_q,  i_q = i_q + a psi_d,  then into the current circle
 * Source   docs/theory/current-reference.md (CR-18)
 * Units    per unit
 * Range    every admittance a (q31) and flux (q15 in words; psi_d saturates at 1)
 * Rounding 1 LSB q15
 * Errors   none: on the current circle the torque is smaller by what the iron takes
 * Context  1 kHz task; a square root on the current circle */
#include "control/torque/current_circle.h"

typedef struct {
    q31_t admittance; /* a; has the sign of the speed */
    dq_q15_t psi;     /* flux at the last references */
    q15_t i_max;
} iron_loss_in_t;

static inline dq_q15_t iron_loss_add(const iron_loss_in_t *in, dq_q15_t magnetising)
{
    const int32_t a = in->admittance;
    /* Q31 * Q31 = Q30 in the upper word */
    const int32_t d = magnetising.d - fx_round_q15_word(fx_mulhi(a, fx_sat_q15_word(in->psi.q) * 65536));
    const int32_t q = magnetising.q + fx_round_q15_word(fx_mulhi(a, fx_sat_q15_word(in->psi.d) * 65536));
    const dq_q15_t inside = current_circle_limit((dq_q15_t){fx_sat_q15_word(d), fx_abs_q15(fx_sat_q15_word(q))},
                                                 in->i_max);
    return (dq_q15_t){inside.d, (q < 0) ? -inside.q : inside.q};
}

#endif
