/* SPDX-License-Identifier: Apache-2.0 */
#ifndef SUPPORT_COUNTED_H
#define SUPPORT_COUNTED_H
/** Counted steps of a monitor; `step` returns true in a step in which it finds something.
 * Units    steps
 * Errors   a finding where none is allowed fails the test
 * Context  tests */
#include <stdbool.h>

#include "unity.h"

enum { NEVER = 0 };

/** So many steps, in which nothing may be found. */
static inline void run_without_finding(bool (*step)(void), int steps)
{
    for (int n = 0; n < steps; n++) {
        TEST_ASSERT_FALSE(step());
    }
}

/** The step in which something is found, the first one is 1; NEVER if it is not found in so many steps. */
static inline int found_in_step(bool (*step)(void), int steps)
{
    for (int n = 1; n <= steps; n++) {
        if (step()) {
            return n;
        }
    }
    return NEVER;
}

#endif
