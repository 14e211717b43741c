/* SPDX-License-Identifier: Apache-2.0 */
#include "drive/recall.h"

#include "control/identify/q30.h"

#define LAST_BUT_ONE 9     /* steps of an update that are averaged when it is checked */
#define CORNER_SHARE 2     /* half of the speed at which errors of voltage and of flux weigh the same */
#define FLUX_SHARE_SHIFT 2 /* a quarter */

void recall_begin(drive_t *drive)
{
    drive->task.recall = (recall_t){.unconfirmed = true};
}

/* All steps of this update but the last one are averaged, and the torque is large enough to decide. */
static bool is_conclusive(const drive_t *drive)
{
    const identify_state_t *state = &drive->task.identify;
    return state->steps == LAST_BUT_ONE && state->kept.update_valid &&
           fx_abs_q15(drive->task.identification.torque_estimated) >= drive->motor->identify.torque_min;
}

/* The mean so far contains nine of an update's ten steps, and the bound is reduced in the same ratio. */
static bool is_explained(const drive_t *drive, q31_t omega)
{
    const dq_q30_t e = drive->task.identify.mean.e;
    const int32_t bound = identify_mul(fx_abs_q31(omega / 2), drive->motor->identify.noise_flux_q30) >>
                          FLUX_SHARE_SHIFT;
    const int32_t averaged = bound / IDENTIFY_STEPS * LAST_BUT_ONE;
    return fx_abs_q31(e.d) <= averaged && fx_abs_q31(e.q) <= averaged;
}

static void count_update(const drive_t *drive, recall_t *recall, q31_t omega)
{
    const q15_t corner = drive->motor->identify.local_corner;
    recall->agreed = is_explained(drive, omega) ? (uint8_t)(recall->agreed + 1U) : 0U;
    if (fx_abs_q15(fx_q15_from_q31(omega)) >= corner / CORNER_SHARE) {
        recall->trials++;
    }
}

void recall_step(drive_t *drive, q31_t omega)
{
    recall_t *recall = &drive->task.recall;
    if (!recall->unconfirmed) {
        return;
    }
    if (is_conclusive(drive)) {
        count_update(drive, recall, omega);
    }
    const bool rejected = recall->trials >= RECALL_TRIALS ||
                          drive->task.identify.gate_exceeded_updates >= RECALL_GATE_EXCEEDED;
    if (recall->agreed >= RECALL_AGREED) {
        recall->unconfirmed = false;
    } else if (rejected) {
        drive_reset_identification(drive);
    } else {
        /* neither confirmed nor rejected yet */
    }
}
