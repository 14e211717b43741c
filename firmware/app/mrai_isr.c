/* SPDX-License-Identifier: Apache-2.0 */
#include "app/drive.h"

/* The bridge was off, so that its voltage is not ours, or the sample before was not seen: only the currents are known.
 * Or what was identified is to be forgotten: then it goes on from this sample, too, not from zero flux. */
static __attribute__((noinline, cold)) void begin_anew(drive_t *drive, const mrai_schedule_t *schedule,
                                                       const mrai_in_t *in)
{
    slow_state_t *slow = &drive->slow;
    if (drive->request.identification_resets != slow->identification_resets) {
        slow->identification_resets = drive->request.identification_resets;
        slow->mrai = (mrai_state_t){0};
    }
    mrai_reset(&drive->motor.mrai, schedule, &slow->mrai, in);
}

/* The 2014 paper's law, each period. The robust identification needs nothing of this: its sums are the fast ISR's, the
 * rest the 1 kHz task's. */
void mrai_isr(drive_t *drive)
{
    const uint32_t generation = drive->samples.generation;
    const sample_t *sample = sample_box_look(&drive->samples, generation);
    slow_state_t *slow = &drive->slow;
    const mrai_config_t *config = &drive->motor.mrai;
    const mrai_schedule_t *schedule = schedule_box_read(&drive->schedules);

    if (__builtin_expect(!sample->acting || generation - slow->finished != 1U ||
                             drive->request.identification_resets != slow->identification_resets, 0)) {
        begin_anew(drive, schedule, &sample->mrai);
    } else {
        mrai_step(config, schedule, &slow->mrai, &sample->mrai);
    }
    const int32_t psi_delta = mrai_psi_delta_q15(&slow->mrai);
    slow->psi_delta_q15 = (q15_t)psi_delta;
    torque_estimate_add(&slow->torque, &sample->mrai.i, &sample->mrai.flux, psi_delta);
    slow->finished = generation;
}
