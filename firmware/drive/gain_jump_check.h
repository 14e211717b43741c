/* SPDX-License-Identifier: Apache-2.0 */
#ifndef DRIVE_GAIN_JUMP_CHECK_H
#define DRIVE_GAIN_JUMP_CHECK_H
/** Feeds safety/gain_jump.h: current sensors whose common gain jumps.
 * Source   docs/theory/monitors.md (MN-58) ... (MN-61)
 * Units    per unit
 * Range    every snapshot
 * Errors   returns FAULT_INPUT or 0
 * Context  1 kHz task, before the torque monitor of the same step, whose residual of the last step it compares */
#include "drive/drive.h"

/** comparable: the window of this step is complete, the bridge acts, and the compensation of dead time is that of the
 * last step. */
uint32_t gain_jump_check(drive_t *drive, const snapshot_t *snapshot, bool comparable, winding_resistance_t r);

#endif
