/* SPDX-License-Identifier: Apache-2.0 */
#ifndef DRIVE_ACQUIRE_H
#define DRIVE_ACQUIRE_H
/** The first half of a period: converters and angle sensor, in per unit, against the limits of a usual period.
 * Source   docs/architecture.md
 * Errors   an implausible step of the angle is noted for the monitors
 * Context  fast ISR */
#include "drive/drive.h"

typedef struct {
    int32_t angle_step; /* electrical advance per period, 2^32 = one turn */
    bool within_limits; /* no monitor would count or report anything */
} acquired_t;

/** settled: the angle tracker has been running for some periods. */
acquired_t acquire_sample(drive_t *drive, sample_t *sample, bool settled);

#endif
