/* SPDX-License-Identifier: Apache-2.0 */
#ifndef SAFETY_OPEN_SWITCH_H
#define SAFETY_OPEN_SWITCH_H
/** A switch that does not switch on, found in a short circuit, which is then incomplete.
 *   In the short circuit by the lower switches, a phase whose switch stays off conducts only through the diode of that
 *   switch: its current flows out of the bridge, and where it would have to flow into the bridge, the phase has a
 *   positive voltage. By the upper switches current and voltage have the opposite signs.
 *   s = sum of psi_k - psi_(k-1), in the stator's frame, since the field has last turned by a whole turn: a complete
 *     short circuit has no voltage and keeps the flux. Begun anew where a phase current is beyond i_max.
 *   d_x: angle by which the field has turned since i_x last was above i_min in the direction that the diode blocks, not
 *     counted while all three currents are below 2 i_min
 *   Currents whose sum is above sum_max in magnitude are not counted, because a sensor is wrong or saturated; the sum
 *     begins anew after them.
 *   lower switch open: the s_x of the largest magnitude is above psi_min, or by the lower switches a d_x has reached a
 *     whole turn; upper switch open: the opposite signs, the upper switches
 *   The flux of the beginning adds a constant part to the currents, which may last for several turns and look like d_x.
 *   The change of side is then unnecessary, and in a bridge without a defect it has no effect.
 * Source   docs/theory/safe-state.md (SS-22), (SS-23)
 * Units    per unit; angles in turns times 2^16
 * Range    every argument; i_min > 0, psi_min > 0
 * Rounding flux: 1 LSB q15 per component; angles towards 0, 2^-16 of a turn per period
 * Errors   none; flux and angles saturate
 * Context  fast ISR, in each period of a short circuit; no division */
#include <stdbool.h>
#include <stdint.h>

#include "fx/q.h"
#include "types/frames.h"

typedef struct {
    q15_t i_min;     /* a phase current up to this counts as none */
    q15_t i_max;     /* up to this the tables have the flux */
    q15_t psi_min;   /* flux that only a phase without its switch can get */
    int32_t sum_max; /* largest sum of the three currents that is plausible */
} open_switch_config_t;

typedef struct {
    bool has_before;     /* before: flux of the last period, in which the currents were below i_max */
    uint16_t turned_q16; /* of the sum */
    q15_t before_alpha, before_beta, sum_alpha, sum_beta;
    uint16_t one_sided_q16[3]; /* d_x */
} open_switch_state_t;

typedef struct {
    abc_q15_t i;
    ab_q15_t psi;       /* of the tables at these currents */
    int32_t angle_step; /* of the field since the period before, 2^32 = one turn */
    bool upper;         /* the short circuit is made by the upper switches */
} open_switch_in_t;

typedef enum {
    OPEN_SWITCH_NONE,
    OPEN_SWITCH_LOWER,
    OPEN_SWITCH_UPPER,
} open_switch_t;

open_switch_t open_switch_step(const open_switch_config_t *config, open_switch_state_t *state,
                               const open_switch_in_t *in);

#endif
