/* SPDX-License-Identifier: Apache-2.0 */
#include "second_level/second_level.h"

#define MEAN_BITS 8
#define FLOW_FACTOR 0x01000193U

/* Parts of a step (QA-2). */
typedef enum { PASSED_FRAMES = 0x51, PASSED_PERMITTED = 0x52, PASSED_COMPARISON = 0x53 } passed_t;

static void pass(second_level_t *level, passed_t part)
{
    level->flow = (level->flow ^ (uint32_t)part) * FLOW_FACTOR;
}

/* The torque is beyond what is permitted (SL-6). */
static bool is_excessive(const second_level_constants_t *constants, const second_level_t *level)
{
    const int32_t mean = level->mean_q8 >> MEAN_BITS;
    const int32_t bound = (mean < 0) ? level->permitted.negative.bound : level->permitted.positive.bound;
    const int32_t share = (int32_t)(((int64_t)constants->tolerance_share * bound) >> 16);
    return fx_abs_q31(mean) > bound + constants->tolerance + share;
}

bool second_level_step(const second_level_constants_t *constants, second_level_t *level, const second_level_in_t *in)
{
    level->flow = in->question;
    second_level_frames_tick(&level->frames, in->elapsed_us);
    pass(level, PASSED_FRAMES);
    const int32_t turn = (int32_t)(in->sample.theta_m - level->theta_m);
    level->theta_m = in->sample.theta_m;
    second_level_permitted_step(constants, &level->permitted, &level->frames, turn, in->slew);
    pass(level, PASSED_PERMITTED);
    if (!in->acting) {
        pass(level, PASSED_COMPARISON); /* there is no torque to be compared */
        level->mean_q8 = 0;
        level->confirmed_steps = 0;
        return false;
    }
    const int32_t torque_q8 = second_level_own_torque(constants, &in->sample, turn) * (1 << MEAN_BITS);
    level->mean_q8 += (torque_q8 - level->mean_q8) >> constants->mean_shift;
    level->confirmed_steps = is_excessive(constants, level) ? level->confirmed_steps + 1 : 0;
    pass(level, PASSED_COMPARISON);
    if (level->confirmed_steps < constants->confirm_steps) {
        return false;
    }
    level->confirmed_steps = constants->confirm_steps;
    return true;
}
