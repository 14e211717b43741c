/* SPDX-License-Identifier: Apache-2.0 */
#ifndef DRIVE_CURRENT_GAIN_H
#define DRIVE_CURRENT_GAIN_H
/** Whether the common gain of the current sensors has jumped, by the samples of a step (safety/current_jump.h):
 *   the dc voltage was steady, no voltage was limited and no pulse clamped in the eight periods before the jump;
 *   T_s/l_min |u_(k-1) - u_(k-2)| < |D_k|/2;
 *   |D_j| <= |D_k|/2 for j = k + 2 ... k + 8; D_k is the largest change of its step
 *   A jump is therefore found 8 periods later at the earliest.
 * Source   docs/theory/monitors.md (MN-57) ... (MN-62)
 * Units    per unit
 * Range    every sample
 * Rounding see safety/current_jump.h
 * Errors   returns true in the step in which the jump is found; the caller raises the fault
 * Context  1 kHz task, once per step; reads a step and 16 samples of the ring in place, which the fast ISR writes again
 *          8 periods later at the earliest (40 periods in a step) */
#include "drive/drive.h"

bool current_gain_has_jumped(drive_t *drive, const snapshot_t *snapshot);

#endif
