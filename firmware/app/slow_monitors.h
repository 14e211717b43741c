/* SPDX-License-Identifier: Apache-2.0 */
#ifndef APP_SLOW_MONITORS_H
#define APP_SLOW_MONITORS_H
/** The monitors that have a millisecond's time, fed from the last sample and what was asked of it.
 * Source   docs/theory/monitors.md, docs/architecture.md
 * Errors   returns the confirmed faults; the fast ISR latches them, as it alone writes the fault word
 * Context  1 kHz task, before this step's references */
#include "app/drive.h"

uint32_t slow_monitors_step(drive_t *drive, const sample_t *sample);

#endif
