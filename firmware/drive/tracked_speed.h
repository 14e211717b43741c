/* SPDX-License-Identifier: Apache-2.0 */
#ifndef DRIVE_TRACKED_SPEED_H
#define DRIVE_TRACKED_SPEED_H
/** What follows from a tracked speed that is far behind the rotor's, at tens of thousands of rpm/s.
 * Source   docs/theory/current-reference.md (CR-15), docs/theory/torque-loop.md (TL-13)
 * Units    per unit
 * Range    every snapshot; a lag that no rotor can cause is none
 * Errors   none
 * Context  1 kHz task; no division */
#include "drive/drive.h"

/** By how much the rotor's speed is beyond the tracked one, less what does not matter; 0 in usual driving. */
int32_t tracked_speed_far_behind(const snapshot_t *snapshot);
/** For the plan of the voltage: the references need that of the rotor's speed, or at the corner of the voltage limit
 * the currents leave them. Where the tracked speed is ahead there is voltage to spare. */
q15_t tracked_speed_planned(const snapshot_t *snapshot);

/** Of the torque, for the torque loop: a correction that belongs to an operating point which a fast change of speed
 * has left is too large for as long as the loop needs. Too much torque, beyond what a step of it causes, counts
 * fourfold. */
q15_t tracked_speed_estimate(drive_t *drive, const snapshot_t *snapshot);

#endif
