/* SPDX-License-Identifier: Apache-2.0 */
#ifndef FUZZ_SENDER_H
#define FUZZ_SENDER_H
/** Frames for the campaign: a sender that mostly follows the protocol, and disturbances: replays, changed bits and
 * bytes, wrong lengths and identifiers, values out of range with a valid CRC, noise.
 * Context  fuzz campaign only; deterministic by seed */
#include <stdint.h>

#include "types/can_frame.h"

typedef struct {
    uint64_t random;
    unsigned counter[2];
    can_frame_t last; /* last valid frame: origin of replays and mutations */
    int torque_dNm;
    unsigned bits; /* mode, reset, enable as in byte 1 */
    unsigned step; /* of the way from a fault to torque */
} sender_t;

void sender_start(sender_t *sender, uint64_t seed);
uint32_t sender_random(sender_t *sender, uint32_t below);
/** The next valid frame: 0 the command, 1 the battery's limits. */
can_frame_t sender_sane(sender_t *sender, unsigned which);
/** A disturbed frame. */
can_frame_t sender_insane(sender_t *sender);

#endif
