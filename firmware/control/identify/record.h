/* SPDX-License-Identifier: Apache-2.0 */
#ifndef IDENTIFY_RECORD_H
#define IDENTIFY_RECORD_H
/** The part of the identification that survives a power cycle: each state and its variance.
 *   restore  P_jj = min(1, stored + growth during the stop), covariances between states 0; the confidence starts at 1
 *            if the variances of magnet and q axis are then below 3/8 of their priors'
 * Source   docs/theory/identification.md (ID-19)
 * Units    as in control/identify/kalman.h; the record has no padding, so that a checksum over its bytes is well
 *          defined
 * Range    a record of another version or with a value out of range is refused and changes nothing
 * Errors   false: refused
 * Context  start-up (restore) and background (get); the caller computes and checks the checksum */
#include "control/identify/identify.h"

#define IDENTIFY_RECORD_VERSION 1U

typedef struct {
    uint32_t version;
    int32_t x_q27[IDENTIFY_STATES];
    int32_t variance_q30[IDENTIFY_STATES];
} identify_record_t;

void identify_record_get(const identify_state_t *state, identify_record_t *record);
bool identify_record_restore(identify_state_t *state, const identify_record_t *record);

#endif
