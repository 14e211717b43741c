/* SPDX-License-Identifier: Apache-2.0 */
#ifndef DRIVE_ACQUIRE_H
#define DRIVE_ACQUIRE_H
/** The first part of a period: samples of converters and angle sensor in per unit, checked against their limits.
 * Source   docs/architecture.md
 * Units    counts of the converters in, per unit of motor.bases out; angles in turns times 2^32
 * Range    every count and every angle
 * Errors   an implausible step of the angle is replaced by the prediction and reported to the monitors
 * Context  fast ISR */
#include "drive/drive.h"

typedef struct {
    int32_t angle_step; /* electrical advance per period, 2^32 = one turn */
    bool within_limits; /* no monitor has to count or report */
} acquired_t;

/** settled: angle and speed of the tracker have been set by its first two samples. */
acquired_t acquire_sample(drive_t *drive, sample_t *sample, bool settled);

/** All sample monitors, with their counters; returns the phase currents. run: the bridge is commanded to act. */
abc_q15_t acquire_check(drive_t *drive, const sample_t *sample, bool run);

#endif
