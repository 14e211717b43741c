/* SPDX-License-Identifier: Apache-2.0 */
#include "drive/tracked_speed.h"

#include "fx/q.h"

#define LAG_SHIFT 5          /* a thirty-second of the speed: within the planned reserve of voltage */
#define LAG_SPEED Q15(0.125) /* of the base: at lower speed the voltage limits no reference */
#define EXCESS Q15(0.03)     /* of the commanded torque: what the second level allows at the largest one (SL-6) */
#define EXCESS_STEPS 5       /* a torque step differs from the loop's model for less than this */
#define EXCESS_GAIN 3        /* added to the excess itself, which then counts fourfold (TL-13) */
#define LAG_MAX Q15(0.0625)  /* twice the largest lag of a rotor of (SS-5); more is a tracker that has just started */

int32_t tracked_speed_far_behind(const snapshot_t *snapshot)
{
    const int32_t speed = fx_abs_q15(fx_q15_from_q31(snapshot->sample.point.omega));
    const int32_t part = fx_max_s32(speed, LAG_SPEED) >> LAG_SHIFT;
    const int32_t lag = (fx_abs_q15(snapshot->lag) <= LAG_MAX) ? snapshot->lag : 0;
    return lag - fx_clamp_q31(lag, -part, part);
}

q15_t tracked_speed_planned(const snapshot_t *snapshot)
{
    const q15_t omega = fx_q15_from_q31(snapshot->sample.point.omega);
    const int32_t more = tracked_speed_far_behind(snapshot);
    return fx_sat_q15((omega < 0) ? omega + fx_min_s32(more, 0) : omega + fx_max_s32(more, 0));
}

q15_t tracked_speed_estimate(drive_t *drive, const snapshot_t *snapshot)
{
    task_state_t *task = &drive->task;
    const int32_t estimated = task->identification.torque_estimated, sign = (task->torque_commanded < 0) ? -1 : 1;
    const int32_t least = fx_max_s32(fx_abs_q15(task->torque_commanded), drive->parameters.torque_loop.torque_min);
    const int32_t too_much = sign * (estimated - fx_q15_from_q31(task->torque_loop.model));
    const int32_t excess = too_much - fx_mul_q15(EXCESS, least);
    const bool counts = tracked_speed_far_behind(snapshot) != 0 || task->excessive != 0U;
    task->excessive = (counts && excess > 0) ? (uint8_t)fx_min_s32(task->excessive + 1, EXCESS_STEPS) : 0U;
    return fx_sat_q15(estimated + ((task->excessive < EXCESS_STEPS) ? 0 : EXCESS_GAIN * sign * excess));
}
