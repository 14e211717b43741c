/* SPDX-License-Identifier: Apache-2.0 */
#ifndef DRIVE_SWITCH_OFF_H
#define DRIVE_SWITCH_OFF_H
/** Leaving torque where disabled switching would rectify.
 *   Enable off: the torque goes to zero at the fastest slew rate, and the current control holds it there until
 *     switching can be disabled. If the rotor reaches this speed with enable off, control begins only with
 *     request.may_hold. The currents are those of field weakening without torque: far below those of the short circuit,
 *     which some machines cannot withstand.
 *   Over-temperature and over-speed leave current control intact, but latching the fault ends it. Before the fault is
 *     latched, i* moves in 8 steps to the steady current of the short circuit, psi_d(i_d, 0) + dpsi = 0 and i_q = 0,
 *     and stays there for 2 steps.
 *   Every other fault is latched at once.
 * Source   docs/theory/safe-state.md (SS-8), (SS-12)
 * Units    per unit of motor.bases
 * Range    i_d down to the demagnetisation limit at the present temperature
 * Errors   none: every other fault stays in *faults
 * Context  1 kHz task; no division */
#include "drive/drive.h"

/** Whether the bridge may switch: the angle is known, the background does not hold the drive, no movement has ended. */
bool switch_off_may_switch(const drive_t *drive, const snapshot_t *snapshot);
/** The run state of this step. It stays RUN while the torque is held at zero, and while the currents are being moved to
 * those of the short circuit; in the latter case *faults becomes 0. */
run_state_t switch_off_step(drive_t *drive, const snapshot_t *snapshot, run_state_t wanted, uint32_t *faults);

/** Enable is off, and the torque is held at zero. */
static inline bool switch_off_holds(const drive_t *drive)
{
    return drive->task.switch_off.holds;
}

/** The currents are being moved to those of the short circuit: the torque path has no part in the reference. */
static inline bool switch_off_runs(const drive_t *drive)
{
    return drive->task.switch_off.steps != 0U;
}

/** The reference of this step. */
dq_q15_t switch_off_reference(const drive_t *drive);

#endif
