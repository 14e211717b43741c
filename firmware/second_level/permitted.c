/* SPDX-License-Identifier: Apache-2.0 */
#include "second_level/permitted.h"

#include "fx/codegen.h"

static int32_t per_unit(const second_level_constants_t *constants, int32_t counts)
{
    return (int32_t)(((int64_t)constants->torque_per_count * counts + 0x8000) >> 16);
}

/* The limit of torque in the direction `sign` (SL-1). */
static int32_t limit_of(const second_level_constants_t *constants, const second_level_frames_t *frames, int32_t turn,
                        int32_t sign)
{
    const bool certain = turn > constants->turn_standstill || turn < -constants->turn_standstill;
    const bool driving = (turn < 0) == (sign < 0);
    const int32_t larger = fx_max_s32(frames->drive_counts, frames->regen_counts);
    const int32_t limit = driving ? frames->drive_counts : frames->regen_counts;
    return fx_min_s32(per_unit(constants, certain ? limit : larger), constants->torque_max);
}

static inline FX_INLINED_IF_OPTIMISED int32_t target_of(const second_level_constants_t *constants,
                                                        const second_level_frames_t *frames, int32_t turn, int32_t sign)
{
    const int32_t counts = sign * frames->torque_counts;
    const bool battery_lost = frames->battery.seen && !frames->battery.alive;
    if (battery_lost || counts <= 0) { /* in each direction unless the request has it */
        return 0;
    }
    return fx_min_s32(per_unit(constants, counts), limit_of(constants, frames, turn, sign));
}

static inline FX_INLINED_IF_OPTIMISED void follow_target(second_level_side_t *side, int32_t target, int32_t fall,
                                                         bool next)
{
    int32_t largest = target;
    if (next) {
        for (int n = SECOND_LEVEL_HOLDS - 1; n > 0; n--) {
            side->held[n] = side->held[n - 1];
        }
        side->held[0] = 0;
    }
    side->held[0] = fx_max_s32(side->held[0], target);
    for (int n = 0; n < SECOND_LEVEL_HOLDS; n++) {
        largest = fx_max_s32(largest, side->held[n]);
    }
    side->bound = fx_max_s32(largest, side->bound - fall);
}

void second_level_permitted_step(const second_level_constants_t *constants, second_level_permitted_t *permitted,
                                 const second_level_frames_t *frames, int32_t turn, int32_t slew)
{
    const int32_t fall = fx_min_s32(constants->fall, slew);
    permitted->steps++;
    const bool next = permitted->steps >= constants->hold_steps;
    if (next) {
        permitted->steps = 0;
    }
    follow_target(&permitted->positive, target_of(constants, frames, turn, 1), fall, next);
    follow_target(&permitted->negative, target_of(constants, frames, turn, -1), fall, next);
}
