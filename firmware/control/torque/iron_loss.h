/* SPDX-License-Identifier: Apache-2.0 */
#ifndef TORQUE_IRON_LOSS_H
#define TORQUE_IRON_LOSS_H
/** Adds the current that supplies the iron loss to the references, which are those of the magnetising current.
 *   i = i_m + s i_fe,  i_fe = a f (-psi_q, psi_d),  f = min(16 (|i_m,d| + |i_m,q|)/i_max, 1)
 *   s = 1; where |i| would exceed i_max, s = (i_max^2 - |i_m|^2)/(|i_m + i_fe|^2 - |i_m|^2), at least 0
 * Source   docs/theory/current-reference.md (CR-18), (CR-19)
 * Units    per unit
 * Range    every admittance a (q31) and flux (q15 in words, which saturate); 0 < i_max < 1
 * Rounding 1 LSB q15; 2^-12 and 2^-18/(|i_m + i_fe|^2 - |i_m|^2), relative, in s
 * Errors   none: on the current circle the torque is smaller by what the iron takes
 * Context  1 kHz task; a division near zero current and at the current circle */
#include "fx/q.h"
#include "types/frames.h"

typedef struct {
    q31_t admittance; /* a; has the sign of the speed */
    dq_q15_t psi;     /* flux at the last references */
    q15_t i_max;
} iron_loss_in_t;

/* Q30; beyond 2 where the loss is large. */
static inline int64_t iron_loss_square(dq_q15_t i)
{
    return (int64_t)i.d * i.d + (int64_t)i.q * i.q;
}

/* a f in Q31. Near zero current the legs do not follow a reference: a small one, which was not requested, would charge
 * the integrators of the current control. */
static inline q31_t iron_loss_admittance(const iron_loss_in_t *in, dq_q15_t i_m)
{
    const int32_t flowing = 16 * (fx_abs_q31(i_m.d) + fx_abs_q31(i_m.q));
    if (flowing >= in->i_max) {
        return in->admittance;
    }
    return fx_mul_q31(in->admittance, (flowing << 12) / in->i_max * (1 << 19));
}

/* Q31 * Q31 = Q30 in the upper word. */
static inline int32_t iron_loss_current(q31_t admittance, int32_t psi)
{
    return fx_round_q15_word(fx_mulhi(admittance, fx_sat_q15_word(psi) * 65536));
}

static inline dq_q15_t iron_loss_add(const iron_loss_in_t *in, dq_q15_t i_m)
{
    const q31_t a = iron_loss_admittance(in, i_m);
    const dq_q15_t iron = {-iron_loss_current(a, in->psi.q), iron_loss_current(a, in->psi.d)};
    const dq_q15_t i = {i_m.d + iron.d, i_m.q + iron.q};
    const int32_t allowed = in->i_max * in->i_max;
    const int64_t square = iron_loss_square(i);
    if (square <= allowed) {
        return i;
    }
    const int64_t square_m = iron_loss_square(i_m);
    const int32_t left = fx_max_s32(allowed - (int32_t)square_m, 0);
    /* Q30/Q18 = Q12, below 1 because square > allowed */
    const int32_t share = left / (int32_t)(((square - square_m) >> 12) + 1);
    return (dq_q15_t){i_m.d + (share * iron.d >> 12), i_m.q + (share * iron.q >> 12)};
}

#endif
