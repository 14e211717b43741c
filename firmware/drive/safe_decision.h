/* SPDX-License-Identifier: Apache-2.0 */
#ifndef DRIVE_SAFE_DECISION_H
#define DRIVE_SAFE_DECISION_H
/** The safe state that a fault would need now, decided in every step before one occurs: by speed, by an over-voltage,
 * by a gate fault. The short circuit is commanded only if the bridge has been switching before; otherwise it may not be
 * powered.
 * Source   docs/theory/safe-state.md
 * Units    per unit of motor.bases
 * Range    every snapshot
 * Errors   none: without a valid speed the last known one counts
 * Context  1 kHz task; the fast ISR applies the decision */
#include "drive/drive.h"

safe_t safe_decision_step(drive_t *drive, const snapshot_t *snapshot);

/** Whether the short circuit would be made by the upper switches. */
bool safe_decision_is_upper(const drive_t *drive);

#endif
