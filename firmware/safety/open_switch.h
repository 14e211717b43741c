/* SPDX-License-Identifier: Apache-2.0 */
#ifndef SAFETY_OPEN_SWITCH_H
#define SAFETY_OPEN_SWITCH_H
/** A switch that does not switch on, found in a short circuit, which is then incomplete. Two searches:
 *   In the short circuit by the lower switches, a phase whose switch stays off conducts only through the diode of that
 *   switch: its current flows out of the bridge, and where it would have to flow into the bridge, the phase has a
 *   positive voltage. By the upper switches current and voltage have the opposite signs.
 *   by flux: s = psi_k - psi_0, in the stator's frame, with psi_0 from the beginning or from when the field had last
 *     turned by a whole turn: a complete short circuit has no voltage and keeps the flux. The s_x of the largest
 *     magnitude above psi_min: lower switch open; below -psi_min: upper switch open. Begun anew where the currents are
 *     beyond i_max or not plausible.
 *   by currents: d_x is the angle by which the field has turned since i_x last was above i_min in the direction that
 *     the diode blocks, not counted while the magnitude of the currents is below 2 i_min. A whole turn: a switch of
 *     this side is open.
 *   The flux of the beginning adds a constant part to the currents, which may last for several turns and look like d_x.
 *   The change of side is then unnecessary, and in a bridge without a defect it has no effect.
 * Source   docs/theory/safe-state.md (SS-22), (SS-23)
 * Units    per unit; angles in turns times 2^16
 * Range    every argument; i_min > 0, psi_min > 0; currents at least every third of a turn, flux twice a turn
 * Rounding flux: 1 LSB q15 per component; angles towards 0, 2^-16 of a turn per sample
 * Errors   none; flux and angles saturate
 * Context  fast ISR, in a short circuit; no division */
#include <stdbool.h>
#include <stdint.h>

#include "fx/q.h"
#include "types/frames.h"

#define OPEN_SWITCH_NOT_PLAUSIBLE INT32_MAX /* in place of a square of currents */

typedef struct {
    q15_t i_min;   /* a phase current up to this counts as none */
    q15_t i_max;   /* magnitude of the currents up to which the tables have the flux */
    q15_t psi_min; /* flux that only a phase without its switch can get */
} open_switch_config_t;

typedef struct {
    bool has_begun;                /* begin: psi_0 */
    uint16_t turned_q16;           /* since psi_0 */
    q15_t begin_alpha, begin_beta; /* psi_0 */
    uint16_t one_sided_q16[3];     /* d_x */
} open_switch_state_t;

typedef struct {
    abc_q15_t i;
    int32_t i_squared_q30; /* i_d^2 + i_q^2, or OPEN_SWITCH_NOT_PLAUSIBLE */
    uint32_t step_q16;     /* turn of the field since the sample before */
    bool upper;            /* the short circuit is made by the upper switches */
} open_switch_in_t;

typedef enum {
    OPEN_SWITCH_NONE,
    OPEN_SWITCH_LOWER,
    OPEN_SWITCH_UPPER,
} open_switch_t;

/** Begins both searches anew. */
void open_switch_reset(open_switch_state_t *state);

/** psi: of the tables at the measured currents. i_squared_q30, step_q16: as in open_switch_in_t. */
open_switch_t open_switch_by_flux(const open_switch_config_t *config, open_switch_state_t *state, ab_q15_t psi,
                                  int32_t i_squared_q30, uint32_t step_q16);

open_switch_t open_switch_by_currents(const open_switch_config_t *config, open_switch_state_t *state,
                                      const open_switch_in_t *in);

#endif
