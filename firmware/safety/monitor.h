/* SPDX-License-Identifier: Apache-2.0 */
#ifndef SAFETY_MONITOR_H
#define SAFETY_MONITOR_H
/** Sample monitors of the fast ISR: pure decisions from one set of samples and a few counters.
 *   over-current  any |i_x| > i_trip in one sample;          over-voltage  v_dc > v_max for 2 samples
 *   under-voltage v_dc < v_min for 10 samples;               current sum   |i_a + i_b + i_c| > sum_max for 5 samples
 *   angle         3 implausible jumps in a row
 * Source   docs/architecture.md, fault table
 * Units    per unit
 * Range    i_trip < 0.8: the trip comes before the converter's end stop
 * Errors   returns the set of faults that are confirmed now; latching is the supervisor's business
 * Context  fast ISR; no division, no loop */
#include <stdbool.h>
#include <stdint.h>

#include "types/faults.h"
#include "types/frames.h"

/* A reason to look closer than monitor_quiet(). */
enum { MONITOR_COUNTS = 1, MONITOR_JUMPED = 2 };

/** q15 in a word each, in the order in which every period reads them. */
typedef struct {
    int32_t quiet_q30; /* (i_trip - sum_max/3)^2: a vector that short has no phase beyond i_trip */
    int32_t zero_max;  /* a third of sum_max */
    int32_t v_min, v_max;
    int32_t i_trip;
    int32_t sum_max;
} monitor_config_t;

typedef struct {
    uint8_t over_voltage, under_voltage, current_sum, angle;
    uint8_t attention; /* MONITOR_..., else a good sample has nothing to do */
} monitor_state_t;

typedef struct {
    abc_t i;
    int32_t v_dc;
} monitor_in_t;

/** What most periods look like, for a fraction of the price: monitor_step() would find nothing, and needs to be called
 * only while it counts (attention). |i_x| <= |i| + |sum|/3: a phase is its share of the vector plus a third of the
 * sum. */
static inline bool monitor_quiet(const monitor_config_t *config, fx_pair_t i, int32_t zero_q28, int32_t v_dc)
{
    const fx_arch_two_t most = fx_arch_load_two(&config->quiet_q30);
    const uint32_t zero_max = (uint32_t)most.second;
    const fx_arch_two_t v = fx_arch_load_two(&config->v_min);
    return (uint32_t)fx_dot2(i, i) < (uint32_t)most.first && (uint32_t)(zero_q28 >> 13) + zero_max < 2U * zero_max &&
           v_dc >= v.first && v_dc <= v.second;
}

/** The angle has jumped: not a quiet period. */
static inline void monitor_note_jump(monitor_state_t *state)
{
    __asm__ volatile(""); /* behind a branch: no instructions that all other periods skip */
    state->attention |= MONITOR_JUMPED;
}

uint32_t monitor_step(const monitor_config_t *config, monitor_state_t *state, const monitor_in_t *in);

#endif
