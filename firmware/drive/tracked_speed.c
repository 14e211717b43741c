/* SPDX-License-Identifier: Apache-2.0 */
#include "drive/tracked_speed.h"

#include "fx/q.h"

#define LAG_SHIFT 5          /* a thirty-second of the speed: within the planned reserve of voltage */
#define LAG_SPEED Q15(0.125) /* of the base: at lower speed the voltage limits no reference */
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
    if (snapshot->lag == 0) { /* in most steps */
        return omega;
    }
    const int32_t more = tracked_speed_far_behind(snapshot);
    return fx_sat_q15((omega < 0) ? omega + fx_min_s32(more, 0) : omega + fx_max_s32(more, 0));
}
