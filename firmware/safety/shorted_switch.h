/* SPDX-License-Identifier: Apache-2.0 */
#ifndef SAFETY_SHORTED_SWITCH_H
#define SAFETY_SHORTED_SWITCH_H
/** The side of a switch that conducts always, found by the currents of one period with switching disabled.
 *   The diodes of an intact bridge connect a phase whose current flows out of the bridge to the lower rail, one whose
 *   current flows into it to the upper rail. g_x is the mean direction of a phase current over the period, 1 out of the
 *   bridge, -1 into it, 0 unknown. The flux shows the mean voltages of the phases, which differ from the diodes' by
 *     r_x = (psi_x - psi_x,last)/T_s + v_dc/2 (g_x - mean of g)
 *   A shorted upper switch makes the r of its phase positive and the largest, a shorted lower one negative and the
 *   largest in magnitude, by v_dc/2 at least. In an intact bridge |r| is at most v_dc/3, from a phase of unknown
 *   direction.
 *   Found if i_x flows through that switch and the largest |r_x| exceeds 25/48 v_dc, where two phases have a direction,
 *   or v_dc/8, where all three have one.
 *   g_x = 0 if |i_x| <= i_min at the end; the sign of i_x there if |i_x| <= i_min at the beginning. Of currents that
 *   have turned around it is that of a straight line if the largest |r| is that of one of them, else 0.
 * Source   docs/theory/safe-state.md (SS-28), (SS-29)
 * Units    per unit
 * Range    every argument in q15; i_min > 0, v_dc >= 0, turn_gain from 0 to 2^28
 * Rounding in r: 1 LSB of the flux times turn_gain/(2 pi), 2^-11 of V_b at the largest turn_gain of the motors here
 * Errors   none: a change of the flux by more than 1 saturates
 * Context  fast ISR, after a gate fault; one division for each current that has turned around */
#include <stdint.h>

#include "fx/q.h"
#include "types/frames.h"

typedef struct {
    abc_q15_t i_last, i;     /* at the beginning and the end of the period */
    fx_pair_t psi_last, psi; /* alpha, beta of the tables at these currents */
    int32_t v_dc;            /* q15 */
    int32_t turn_gain;       /* 2 pi/(omega_b T_s), Q15 */
    q15_t i_min;             /* a phase current up to this has no direction */
} shorted_switch_in_t;

typedef enum {
    SHORTED_SWITCH_NONE,
    SHORTED_SWITCH_LOWER,
    SHORTED_SWITCH_UPPER,
} shorted_switch_t;

shorted_switch_t shorted_switch_find(const shorted_switch_in_t *in);

#endif
