/* SPDX-License-Identifier: Apache-2.0 */
#ifndef IDENTIFY_WINDOW_H
#define IDENTIFY_WINDOW_H
/** The identification's part of every period: sums over the N periods of one step of the 1 kHz task. The caller counts
 *   the periods, because the step is also counted while no window is summed up.
 *   sum_i over samples 1 ... N, sum_u over their voltages, and the samples at both ends of the N periods
 * Source   docs/theory/identification.md (ID-1)
 * Units    q15 counts in words; angles 2^32 = one turn
 * Range    N up to 40: |sum| <= 40 * 2^15; the ends saturate
 * Rounding none: exact
 * Errors   acting is false if the bridge did not switch throughout one of the periods
 * Context  fast ISR; no multiplication, no division, no loop */
#include <stdbool.h>
#include <stdint.h>

#include "control/current/flux_table_types.h"
#include "types/frames.h"

/* In halfwords, because three windows are stored. */
typedef struct {
    dq_q15_halfword_t i, u, psi; /* u acts during the period that starts here */
    uint32_t theta;
} identify_end_t;

typedef struct {
    dq_q15_t sum_i, sum_u;
    identify_end_t first, last;
    uint8_t limited; /* periods so far with clamped pulses */
    bool acting;
} identify_window_t;

typedef struct {
    dq_q15_t i, u;
    const flux_point_t *flux;
    uint32_t theta;
} identify_sample_t;

/** A period of the window is missing, or its voltage is unknown. */
static inline void identify_window_invalidate(identify_window_t *window)
{
    window->acting = false;
}

/** A period of the window has clamped pulses. */
static inline void identify_window_count_limited(identify_window_t *window)
{
    window->limited++;
}

void identify_window_add(identify_window_t *window, const identify_sample_t *in);
/** The sample just added completes the window; the caller copies it and then restarts it. */
void identify_window_end(identify_window_t *window, const identify_sample_t *in);
/** The last sample becomes the first of the next window. */
void identify_window_restart(identify_window_t *window);

#endif
