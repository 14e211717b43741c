/* SPDX-License-Identifier: Apache-2.0 */
#ifndef SECOND_LEVEL_OWN_DATA_H
#define SECOND_LEVEL_OWN_DATA_H
/** Checks in slices, while the drive runs, whether the second level's constants are those that were generated.
 *   CRC-32 (IEEE 802.3) of all bytes behind `checksum`, SECOND_LEVEL_SLICE of them in each step. Damage is found at the
 *   latest at the end of the pass after the one in which it occurred, that is, in fewer steps than two passes take
 * Source   docs/theory/second-level.md (SL-7)
 * Units    bytes
 * Errors   false at the end of a pass that does not match; the caller latches it
 * Context  1 kHz task */
#include <stdbool.h>

#include "second_level/constants.h"

#define SECOND_LEVEL_SLICE 4U

typedef struct {
    uint32_t at;  /* bytes of this pass that have been added */
    uint32_t sum; /* inverted, so that a pass begins with zeros */
} second_level_own_data_t;

bool second_level_own_data_step(const second_level_constants_t *constants, second_level_own_data_t *own);

#endif
