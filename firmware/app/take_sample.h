/* SPDX-License-Identifier: Apache-2.0 */
#ifndef APP_TAKE_SAMPLE_H
#define APP_TAKE_SAMPLE_H
/** The first half of a period: converters and angle sensor are read, put into per unit, and looked at.
 * Source   docs/architecture.md
 * Errors   an implausible step of the angle is noted for the monitors
 * Context  fast ISR */
#include "app/drive.h"

/** What the second half needs besides the sample. */
typedef struct {
    int32_t step; /* electrical advance per period */
    int32_t v_dc;
    bool calm;    /* nothing to look at closely */
} seen_t;

/** settled: the angle tracker has started long ago. */
seen_t take_sample(drive_t *drive, sample_t *sample, bool settled);

#endif
