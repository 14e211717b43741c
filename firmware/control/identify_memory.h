/* SPDX-License-Identifier: Apache-2.0 */
#ifndef CONTROL_IDENTIFY_MEMORY_H
#define CONTROL_IDENTIFY_MEMORY_H
/** What the identification takes over a power cycle: its parameters and how sure it was of each.
 *   restore  P_jj = min(1, stored + what may have happened since), correlations forgotten; trusted at once if
 *            magnet and q axis are then known to 3/8 of their prior's variance
 * Source   docs/theory/identification.md (ID-19)
 * Units    as in control/identify_filter.h; the record holds no padding, so that a checksum over its bytes is sound
 * Range    a record of another version or with a value out of range is refused and changes nothing
 * Errors   false: refused
 * Context  start-up (restore) and background (get); the store's checksum is the caller's */
#include "control/identify.h"

#define IDENTIFY_MEMORY_VERSION 1U

typedef struct {
    uint32_t version;
    int32_t x[IDENTIFY_STATES];
    int32_t variance[IDENTIFY_STATES];
} identify_memory_t;

identify_memory_t identify_memory_get(const identify_state_t *state);
bool identify_memory_restore(identify_state_t *state, const identify_memory_t *memory);

#endif
