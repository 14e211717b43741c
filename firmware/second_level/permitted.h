/* SPDX-License-Identifier: Apache-2.0 */
#ifndef SECOND_LEVEL_PERMITTED_H
#define SECOND_LEVEL_PERMITTED_H
/** The torque that the received frames permit: a band [low, high] that contains zero.
 *   target  min(|request|, limit of its direction, rated torque) on the request's side of zero, 0 on the other;
 *           no torque while the command is invalid or old, or while the battery's limits were received and are lost
 *   high    at once up to the target; down to the largest target of the last hold time, at most `fall` per step: a
 *           legal decrease of torque, with slew and jerk, stays below (SL-2)
 *   Near standstill, where the direction of rotation is uncertain, the larger of both directions' limits counts.
 * Source   docs/theory/second-level.md (SL-1), (SL-2)
 * Units    per unit of T_b
 * Range    every frame that the DBC allows; every turn
 * Rounding 1 LSB q15
 * Errors   none
 * Context  1 kHz task */
#include "second_level/constants.h"
#include "second_level/frames.h"

#define SECOND_LEVEL_HOLDS 4

/* One side of the band, as a magnitude. */
typedef struct {
    int32_t held[SECOND_LEVEL_HOLDS]; /* largest target in each part of the hold time, the present one first */
    int32_t bound;
} second_level_side_t;

typedef struct {
    second_level_side_t positive, negative;
    int32_t steps; /* of the present part of the hold time */
} second_level_permitted_t;

/** turn: change of the mechanical angle in this step; slew: calibrated limit of the torque's change per step. */
void second_level_permitted_step(const second_level_constants_t *constants, second_level_permitted_t *permitted,
                                 const second_level_frames_t *frames, int32_t turn, int32_t slew);

#endif
