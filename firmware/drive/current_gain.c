/* SPDX-License-Identifier: Apache-2.0 */
#include "drive/current_gain.h"

#include "fx/codegen.h"
#include "fx/vec.h"
#include "safety/current_jump.h"

#define CURRENT_MIN Q15(0.04) /* twice the smallest jump that is found, of full scale */
#define MOVED_LSB 4096U       /* Q30 to Q18 */
#define AFTER_PERIODS 8U      /* in which the current must be as quiet after a jump as before it */
#define BEFORE_PERIODS 8U     /* in which no pulse may have been clamped and no voltage limited */
#define VOLTAGE_PERIODS 3U    /* the voltage of a period is computed with the dc voltage of up to two periods before */
#define VOLTAGE_SHIFT 5       /* a change of the dc voltage by a 32nd explains a jump */

static bool is_near(int32_t v_dc, int32_t reference)
{
    return fx_abs_q31(v_dc - reference) <= reference >> VOLTAGE_SHIFT;
}

/* Clamped pulses and a limited voltage move the current, and the answer of current control goes on for some periods. */
static bool is_unlimited(const sample_box_t *box, uint32_t at)
{
    bool unlimited = true;
    for (uint32_t n = 1; unlimited && n <= BEFORE_PERIODS; n++) {
        const sample_t *sample = sample_box_at(box, at - n);
        unlimited = !sample->pulses_clamped && !sample->voltage_limited;
    }
    return unlimited;
}

/* (MN-59): the bridge has followed current control all the time, and its voltage was what the duties say. */
static bool is_voltage_known(const sample_box_t *box, uint32_t at)
{
    const sample_t *now = sample_box_at(box, at), *next = sample_box_at(box, at + 1U);
    const sample_t *before = sample_box_at(box, at - VOLTAGE_PERIODS);
    return before->acting && now->acting && next->acting && is_near(before->v_dc, now->v_dc) &&
           is_near(next->v_dc, now->v_dc) && is_unlimited(box, at);
}

/* (MN-61): the voltage of the period before the jump, less that of the period before it, would have moved the current
 * by less than half of the jump. The gain is that of three periods or more. */
static bool is_unexplained(const sample_box_t *box, uint32_t at, q16_t gain)
{
    const operating_point_t *k = &sample_box_at(box, at)->point, *last = &sample_box_at(box, at - 1U)->point;
    const operating_point_t *before = &sample_box_at(box, at - 2U)->point;
    const q15_t moved = fx_magnitude(fx_sat_q15(k->i.d - last->i.d), fx_sat_q15(k->i.q - last->i.q));
    const q15_t driven = fx_magnitude(fx_sat_q15(last->u.d - before->u.d), fx_sat_q15(last->u.q - before->u.q));
    return fx_mul_gain_q15_word(gain, driven) < moved + moved / 2;
}

/* The largest change of the current in some periods. */
typedef struct {
    uint32_t at;     /* the sample after it */
    uint32_t moved;  /* (|D|/2)^2, Q30 */
    uint32_t before; /* the largest one of those before it */
} change_t;

static change_t largest_change(const sample_box_t *box, uint32_t first, uint32_t end)
{
    change_t largest = {.at = first};
    dq_q15_t last = sample_box_at(box, first - 1U)->point.i;
    FX_ADDRESS_ONCE(box);
    for (uint32_t at = first; at != end; at++) {
        const dq_q15_t now = sample_box_at(box, at)->point.i;
        const uint32_t moved = current_jump_moved(last, now);
        if (moved > largest.moved) {
            largest = (change_t){at, moved, largest.moved};
        }
        last = now;
    }
    return largest;
}

/* (MN-62): noise that begins or grows goes on; the answer of current control moves a third of the jump at most. */
static bool is_quiet_after(const sample_box_t *box, const change_t *jump)
{
    return largest_change(box, jump->at + 2U, jump->at + AFTER_PERIODS + 1U).moved <= jump->moved >> 2;
}

static bool has_jumped(const drive_t *drive, const change_t *change)
{
    const sample_box_t *box = &drive->samples;
    const uint32_t at = change->at;
    return current_jump_is_of_gain(sample_box_at(box, at - 1U)->point.i, sample_box_at(box, at)->point.i,
                                   sample_box_at(box, at + 1U)->point.i) &&
           is_quiet_after(box, change) && is_voltage_known(box, at) &&
           is_unexplained(box, at, drive->motor->plausibility.behind_gain);
}

bool current_gain_has_jumped(drive_t *drive, const snapshot_t *snapshot)
{
    task_state_t *task = &drive->task;
    if (!snapshot->sample.acting || snapshot->i_magnitude < CURRENT_MIN || drive_bypasses_torque_path(drive)) {
        task->current_moved_q18 = UINT16_MAX; /* nothing stands out in the step after this one */
        return false;
    }
    const uint32_t end = snapshot->generation + 1U - AFTER_PERIODS, first = end - drive->period.periods_per_step;
    const uint32_t before = (uint32_t)task->current_moved_q18 * MOVED_LSB;
    const change_t largest = largest_change(&drive->samples, first, end);
    task->current_moved_q18 = (uint16_t)fx_usat_bits((int32_t)((largest.moved + MOVED_LSB - 1U) / MOVED_LSB), 16);
    return current_jump_stands_out(largest.moved, before) && current_jump_stands_out(largest.moved, largest.before) &&
           has_jumped(drive, &largest);
}
