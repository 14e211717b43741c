/* SPDX-License-Identifier: Apache-2.0 */
#ifndef DRIVE_EXCESS_TORQUE_H
#define DRIVE_EXCESS_TORQUE_H
/** Torque estimate for the torque loop. In field weakening the correction that belongs to the previous operating point
 * may be far too large until the loop has followed. There, torque in excess of the loop's model counts fourfold:
 *   e = sign(T*) (T^ - T_m) - a max(|T*|, T_min) - |T* - T_m|
 *   a = 3 % until e > 0 in 5 steps in a row, 1 % from then on
 *   T^ <- T^ + 3 e sign(T*) from the fifth of these steps on, until e <= 0
 * Source   docs/theory/torque-loop.md (TL-13)
 * Units    per unit
 * Range    every estimate, command and model
 * Rounding half up, 1/2 LSB q15 in e
 * Errors   none; saturates
 * Context  1 kHz task; no division */
#include "drive/drive.h"

/** Counts the steps in the drive's task.excessive. Once per step, before the torque loop. */
q15_t excess_torque_estimate(drive_t *drive);

#endif
