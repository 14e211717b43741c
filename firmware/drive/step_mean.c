/* SPDX-License-Identifier: Apache-2.0 */
#include "drive/step_mean.h"

#include "fx/vec.h"

static bool has_sums(const snapshot_t *snapshot)
{
    return !snapshot->mrai_is_chosen && snapshot->window.acting;
}

dq_q15_t step_mean_of(const drive_t *drive, dq_q15_t sum)
{
    const int32_t half_gain_q32 = drive->motor->identify.mean_gain_q32;
    return (dq_q15_t){fx_mulhi(2 * sum.d, half_gain_q32), fx_mulhi(2 * sum.q, half_gain_q32)};
}

void step_mean_take(const drive_t *drive, snapshot_t *snapshot)
{
    const operating_point_t *point = &snapshot->sample.point;
    snapshot->i_magnitude = fx_magnitude(point->i.d, point->i.q);
    snapshot->i_mean = has_sums(snapshot) ? step_mean_of(drive, snapshot->window.sum_i) : point->i;
    snapshot->u_mean = has_sums(snapshot) ? step_mean_of(drive, snapshot->window.sum_u) : point->u;
}
