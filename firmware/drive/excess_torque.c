/* SPDX-License-Identifier: Apache-2.0 */
#include "drive/excess_torque.h"

#include "fx/q.h"

#define EXCESS Q15(0.03)      /* of the commanded torque, until it has lasted */
#define EXCESS_LEFT Q15(0.01) /* from then on: with 3 % the torque would stay where the second level trips (SL-6) */
#define EXCESS_STEPS 5        /* a torque step differs from the loop's model for less than this */
#define EXCESS_GAIN 3         /* added to the excess itself, which then counts fourfold */

/* The trim of field weakening (CR-13) is zero on maximum torque per ampere, and returns to zero within 0.2 s. */
static bool is_weakening(const task_state_t *task)
{
    return fx_q15_from_q31(task->voltage_reserve.trim) != 0;
}

q15_t excess_torque_estimate(drive_t *drive)
{
    task_state_t *task = &drive->task;
    const int32_t estimated = task->identification.torque_estimated;
    if (!is_weakening(task)) {
        task->excessive = 0;
        return (q15_t)estimated;
    }
    const int32_t commanded = task->torque_commanded;
    const int32_t model = fx_q15_from_q31(task->torque_loop.model);
    const int32_t sign = (commanded < 0) ? -1 : 1;
    const int32_t least = fx_max_s32(fx_abs_q15(commanded), drive->parameters.torque_loop.torque_min);
    const q15_t share = (task->excessive < EXCESS_STEPS) ? EXCESS : EXCESS_LEFT;
    const int32_t tolerated = fx_mul_q15(share, least) + fx_abs_q31(commanded - model);
    const int32_t excess = sign * (estimated - model) - tolerated;
    task->excessive = (excess > 0) ? (uint8_t)fx_min_s32(task->excessive + 1, EXCESS_STEPS) : 0U;
    return fx_sat_q15(estimated + ((task->excessive < EXCESS_STEPS) ? 0 : EXCESS_GAIN * sign * excess));
}
