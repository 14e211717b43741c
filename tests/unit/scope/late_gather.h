/* SPDX-License-Identifier: Apache-2.0 */
#ifndef TESTS_UNIT_SCOPE_LATE_GATHER_H
#define TESTS_UNIT_SCOPE_LATE_GATHER_H
/** The HAL's copies as late as hardware may make them: nothing has been copied until the test lets the copy end. It
 * fails the test if it is used while it is not idle.
 * Context  unit tests */
#include "hal/gather.h"

typedef struct {
    bool there;                             /* false: a port without the hardware */
    bool stuck;                             /* a copy never ends */
    uint32_t copies, parts, moves, set_ups; /* counted */
} late_gather_t;

extern late_gather_t late_gather;

void late_gather_reset(bool there);
/** What was started is copied now. */
void late_gather_end(void);

#endif
