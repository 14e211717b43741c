/* SPDX-License-Identifier: Apache-2.0 */
#ifndef DRIVE_IRON_CURRENT_H
#define DRIVE_IRON_CURRENT_H
/** The references of the terminals from those of the magnetising current, which the tables give. Without the current of
 * the iron loss every torque would be too small by the loss.
 * Source   docs/theory/current-reference.md (CR-18)
 * Units    per unit
 * Range    every reference inside the current circle
 * Errors   none
 * Context  1 kHz task */
#include "control/torque/iron_loss.h"
#include "drive/drive.h"

static inline dq_q15_t drive_add_iron_current(const drive_t *drive, dq_q15_t i_m)
{
    const task_state_t *task = &drive->task;
    const iron_loss_in_t in = {
        .admittance = task->identification.iron_admittance,
        .psi = {task->psi_ref.d + task->identification.psi_d_error, task->psi_ref.q},
        .i_max = drive->motor->current_reference.i_max,
    };
    return iron_loss_add(&in, i_m);
}

#endif
