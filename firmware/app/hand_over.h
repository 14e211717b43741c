/* SPDX-License-Identifier: Apache-2.0 */
#ifndef APP_HAND_OVER_H
#define APP_HAND_OVER_H
/** The end of a period: its sample goes to the identification.
 *   robust  ten periods are summed up here; the paper's  its law runs below, in the interrupt that is pended
 * Source   docs/architecture.md, shared data
 * Errors   an identification that is not finished in time is counted, the third time in a row is a fault
 * Context  fast ISR */
#include "app/drive.h"

/** next: the sample's generation. */
void hand_over(drive_t *drive, const sample_t *sample, uint32_t next);
/** Samples are unfinished. True: even the one in the slot whose turn it is. */
bool hand_over_late(drive_t *drive, uint32_t unfinished);

#endif
