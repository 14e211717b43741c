/* SPDX-License-Identifier: Apache-2.0 */
#ifndef SAFETY_SAFE_STATE_H
#define SAFETY_SAFE_STATE_H
/** Safe state that a fault would need now: active short circuit by the low-side switches, or switching disabled.
 *   e = sqrt(3) |w| max(psi_f, psi_f + dpsi), the line back-EMF's peak
 *   e > 0.9 v_dc: short circuit, because the diodes would otherwise rectify the back-EMF into the battery and brake;
 *   e < 0.8 v_dc: switching disabled; between both levels the last decision holds.
 *   Short circuit also while an over-voltage is latched and v_dc is above v_release.
 *   Without a valid speed the last valid one is used, with 0.8 v_dc as the only level.
 * Source   docs/theory/safe-state.md (SS-1) ... (SS-4)
 * Units    per unit
 * Range    every argument; e saturates at 1
 * Rounding 1 LSB q15, well inside the hysteresis
 * Errors   none
 * Context  1 kHz task, which passes the decision to the fast ISR before a fault occurs; no division */
#include <stdbool.h>

#include "fx/q.h"

typedef struct {
    q15_t psi_f;
    q15_t share_short, share_open; /* of v_dc */
    q15_t v_release;               /* an over-voltage has ended below this */
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
