/* SPDX-License-Identifier: Apache-2.0 */
#ifndef DRIVE_TRACKED_SPEED_H
#define DRIVE_TRACKED_SPEED_H
/** Corrects the speed while the tracked one lags far behind the rotor's: at tens of thousands of rpm/s.
 * Source   docs/theory/current-reference.md (CR-15)
 * Units    per unit
 * Range    every snapshot; a lag that no rotor can cause counts as 0
 * Errors   none
 * Context  1 kHz task; no division */
#include "drive/drive.h"

/** Lag of the tracked speed behind the rotor's beyond a tolerance of 1/32 of the speed; 0 in usual driving. */
int32_t tracked_speed_far_behind(const snapshot_t *snapshot);
/** Speed for planning the voltage. The references must leave the voltage that the rotor's speed needs, or the currents
 * deviate from them near the voltage limit. A tracked speed that is too high only leaves voltage unused. */
q15_t tracked_speed_planned(const snapshot_t *snapshot);

#endif
