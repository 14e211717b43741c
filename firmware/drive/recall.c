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

/* The voltage of a flux error of a quarter of the noise. The means contain nine of an update's ten steps so far, and
 * the bound is reduced in the same ratio. */
static int32_t bound_of(const drive_t *drive, q31_t omega)
{
    const int32_t bound = identify_mul(fx_abs_q31(omega / 2), drive->motor->identify.noise_flux_q30) >>
                          FLUX_SHARE_SHIFT;
    return bound / IDENTIFY_STEPS * LAST_BUT_ONE;
}

static bool is_explained(const drive_t *drive, int32_t bound)
{
    const dq_q30_t e = drive->task.identify.mean.e;
    return fx_abs_q31(e.d) <= bound && fx_abs_q31(e.q) <= bound;
}

/* The recalled resistance and voltage drop explain no more of an axis's voltage than the bound. */
static bool is_loss_small(const identify_state_t *state, const jacobian_row_t *row, int32_t bound)
{
    const int32_t *x_q27 = state->kalman.x_q27;
    const int32_t sum_q25 = fx_mulhi(x_q27[IDENTIFY_R], row->h_q30[IDENTIFY_R]) +
                            fx_mulhi(x_q27[IDENTIFY_DROP], row->h_q30[IDENTIFY_DROP]);
    return fx_abs_q31(sum_q25) <= bound >> 5;
}

/* Negative while braking, when the voltage drop has the other sign against the back-EMF. */
static q15_t driving_speed(const drive_t *drive, q31_t omega)
{
    const q15_t speed = fx_q15_from_q31(omega);
    return (drive->task.identification.torque_estimated < 0) ? fx_sat_q15(-speed) : speed;
}

/* A wrong resistance or voltage drop can hide a wrong flux at one speed (ID-23). It does not at a second one, of 3/2 or
 * 2/3 of the first or with torque in the other direction, and hides little from twice the corner on. */
static bool is_flux_separated(recall_t *recall, q15_t speed, q15_t corner)
{
    const int32_t first = recall->first_speed;
    const int32_t size = fx_abs_q15(speed);
    const int32_t larger = fx_max_s32(fx_abs_q31(first), size);
    if (first == 0) {
        recall->first_speed = speed;
    }
    return size >= 2 * corner || (first != 0 && 3 * fx_abs_q31(speed - first) >= larger);
}

static void count_update(const drive_t *drive, recall_t *recall, q31_t omega)
{
    const identify_state_t *state = &drive->task.identify;
    const q15_t corner = drive->motor->identify.local_corner;
    const q15_t speed = driving_speed(drive, omega);
    const int32_t bound = bound_of(drive, omega);
    recall->agreed = is_explained(drive, bound) ? (uint8_t)(recall->agreed + 1U) : 0U;
    const bool hides_nothing = is_loss_small(state, &state->mean.d, bound) &&
                               is_loss_small(state, &state->mean.q, bound);
    if (recall->agreed >= RECALL_AGREED && !hides_nothing && !is_flux_separated(recall, speed, corner)) {
        recall->agreed = RECALL_AGREED - 1U;
    }
    if (fx_abs_q15(speed) >= corner / CORNER_SHARE) {
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
