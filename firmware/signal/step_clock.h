/* SPDX-License-Identifier: Apache-2.0 */
#ifndef SIGNAL_STEP_CLOCK_H
#define SIGNAL_STEP_CLOCK_H
/** True time for a task whose step is not exactly one millisecond.
 *   Every step adds its length in nanoseconds. elapsed_us is the number of whole microseconds, passed_ms of whole
 *   milliseconds, that became complete in this step: both vary by one from step to step, and their sums never drift.
 *   An age adds elapsed_us in every step and reaches its limit in the first step in which that time has passed.
 *   A cyclic message is due in the step in which its millisecond has passed.
 * Source   docs/decisions/010-true-time.md
 * Units    as named; ms wraps after 49 days
 * Range    steps of 0.8 ... 1.25 ms; anything else counts as 1 ms, so that time passes even with damaged data
 * Rounding none: exact in nanoseconds
 * Errors   none
 * Context  step_clock_start() once, step_clock_step() at the start of each step; only step_clock_start() divides */
#include <stdint.h>

#define STEP_CLOCK_NOMINAL_NS 1000000U

typedef struct {
    uint32_t step_us, step_ns; /* length of a step: whole microseconds and the rest */
    uint32_t rest_us, rest_ns; /* since the last whole millisecond, since the last whole microsecond */
    uint32_t elapsed_us;       /* in the last step */
    uint32_t passed_ms;        /* in the last step: 0, 1 or 2 */
    uint32_t ms;               /* since the start */
} step_clock_t;

static inline void step_clock_start(step_clock_t *clock, uint32_t step_ns)
{
    const uint32_t ns = (step_ns >= 800000U && step_ns <= 1250000U) ? step_ns : STEP_CLOCK_NOMINAL_NS;
    *clock = (step_clock_t){.step_us = ns / 1000U, .step_ns = ns % 1000U};
}

static inline void step_clock_step(step_clock_t *clock)
{
    clock->elapsed_us = clock->step_us;
    clock->rest_ns += clock->step_ns;
    if (clock->rest_ns >= 1000U) {
        clock->rest_ns -= 1000U;
        clock->elapsed_us++;
    }
    clock->passed_ms = 0;
    clock->rest_us += clock->elapsed_us;
    while (clock->rest_us >= 1000U) {
        clock->rest_us -= 1000U;
        clock->passed_ms++;
    }
    clock->ms += clock->passed_ms;
}

#endif
