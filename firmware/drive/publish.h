/* SPDX-License-Identifier: Apache-2.0 */
#ifndef DRIVE_PUBLISH_H
#define DRIVE_PUBLISH_H
/** The last part of a period: its sample is passed to the 1 kHz task and to the chosen identification.
 *   robust  the sums of a window are updated here;   the paper's  its law runs in a lower interrupt (drive/mrai)
 *   Once per step it also checks that the task has written a command since the last step. Without a command in two
 *   whole steps while the bridge runs, the safe state follows, within 3 ms of the last command.
 * Source   docs/architecture.md, shared data
 * Units    per unit of motor.bases
 * Range    every sample
 * Errors   FAULT_OVERRUN
 * Context  fast ISR */
#include "drive/drive.h"

void publish_sample(drive_t *drive, const sample_t *sample);

#endif
