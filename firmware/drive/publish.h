/* SPDX-License-Identifier: Apache-2.0 */
#ifndef DRIVE_PUBLISH_H
#define DRIVE_PUBLISH_H
/** The end of a period: its sample goes to the 1 kHz task and to the identification that is chosen.
 *   robust  the sums of a window are formed here   the paper's  its law runs in the interrupt below (drive/mrai)
 * Source   docs/architecture.md, shared data
 * Context  fast ISR */
#include "drive/drive.h"

void publish_sample(drive_t *drive, const sample_t *sample);

#endif
