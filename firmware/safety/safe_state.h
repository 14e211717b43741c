/* SPDX-License-Identifier: Apache-2.0 */
#ifndef SAFETY_SAFE_STATE_H
#define SAFETY_SAFE_STATE_H
/** Which safe state a fault would need now: phases shorted by the low sides, or all gates open.
 *   e = sqrt(3) |w| max(psi_f, psi_f + dpsi), the line back-EMF's peak
 *   short circuit above 0.9 v_dc: open gates would rectify into the battery and brake; open gates below 0.8 v_dc;
 *   between them as before. While an over-voltage is latched and v_dc has not come back: short circuit.
 *   Without a valid speed the last valid one counts, and 0.8 is enough for the short circuit.
 * Source   docs/theory/safe-state.md (SS-1) ... (SS-4)
 * Units    per unit
 * Range    every argument; e saturates at 1
 * Rounding 1 LSB q15, well inside the hysteresis
 * Errors   none
 * Context  1 kHz task, which tells the fast ISR beforehand; no division */
#include <stdbool.h>

#include "fx/q.h"

typedef struct {
    q15_t psi_f;
    q15_t share_short, share_open; /* of v_dc */
    q15_t v_release;               /* below it an over-voltage is over */
} safe_state_config_t;

typedef struct {
    q15_t speed; /* last valid one */
    bool short_circuit;
} safe_state_state_t;

typedef struct {
    q15_t omega;
    q15_t psi_delta; /* identified flux minus the table's */
    q15_t v_dc;
    bool speed_valid;
    bool over_voltage; /* latched */
} safe_state_in_t;

bool safe_state_step(const safe_state_config_t *config, safe_state_state_t *state, const safe_state_in_t *in);

#endif
