/* SPDX-License-Identifier: Apache-2.0 */
#ifndef DRIVE_STEP_MEAN_H
#define DRIVE_STEP_MEAN_H
/** Means over the last step of the 1 kHz task, from the sums of the robust identification. Samples at the steps are at
 * the same angles wherever the field turns by whole half turns in a step, and there a ripple looks like a constant.
 * Source   docs/theory/current-reference.md (CR-12)
 * Units    per unit
 * Range    every snapshot; without sums (the paper's identification, a bridge that did not switch) the last sample
 * Rounding half up
 * Errors   none
 * Context  1 kHz task; no division */
#include "drive/drive.h"

/** Means of current and acting voltage, and the magnitude of the sample's current, into the snapshot. */
void step_mean_take(const drive_t *drive, snapshot_t *snapshot);
/** The sums of a window as means. */
dq_q15_t step_mean_of(const drive_t *drive, dq_q15_t sum);

#endif
