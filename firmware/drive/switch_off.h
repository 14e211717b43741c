/* SPDX-License-Identifier: Apache-2.0 */
#ifndef DRIVE_SWITCH_OFF_H
#define DRIVE_SWITCH_OFF_H
/** Leaving torque where the safe state is the short circuit: the current control first moves the currents to those of
 * the short circuit, so that closing it changes nothing.
 *   i* goes in 8 steps from where it is to i_d with psi_d(i_d, 0) + dpsi = 0, i_q = 0, and stays there for 2
 *   Applies when enable goes off, and to faults that leave the control intact: over-temperature and over-speed, which
 *   are raised afterwards. Every other fault brings the short circuit at once.
 * Source   docs/theory/safe-state.md (SS-8)
 * Range    i_d down to the demagnetisation limit at the present temperature
 * Context  1 kHz task; no division */
#include "drive/drive.h"

/** The run state of this step. While the currents are being moved it stays RUN and *faults becomes 0. */
run_state_t switch_off_step(drive_t *drive, const snapshot_t *snapshot, run_state_t wanted, uint32_t *faults);

/** The currents are being moved: the torque path has no part in the reference. */
static inline bool switch_off_runs(const drive_t *drive)
{
    return drive->task.switch_off.steps != 0U;
}

/** The reference of this step. */
dq_q15_t switch_off_reference(const drive_t *drive);

#endif
