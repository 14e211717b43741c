/* SPDX-License-Identifier: Apache-2.0 */
#ifndef FUZZ_SENDER_H
#define FUZZ_SENDER_H
/** Frames for the campaign: a sender that is mostly sane, and whatever else may come along a bus: replays, bits and
 * bytes flipped, lengths, identifiers, values out of range with a good CRC, noise.
 * Context  fuzz campaign only; deterministic by seed */
#include <stdint.h>

#include "types/can_frame.h"

typedef struct {
    uint64_t random;
    unsigned counter[2];
    can_frame_t last; /* the last frame of the sane sender: what replays and mutations start from */
    int torque_dNm;
    unsigned bits; /* mode, reset, enable as in byte 1 */
    unsigned step; /* of the way from a fault to torque */
} sender_t;

void sender_start(sender_t *sender, uint64_t seed);
uint32_t sender_random(sender_t *sender, uint32_t below);
/** What a vehicle would send next: 0 the command, 1 the battery's limits. */
can_frame_t sender_sane(sender_t *sender, unsigned which);
/** Anything else. */
can_frame_t sender_insane(sender_t *sender);

#endif
