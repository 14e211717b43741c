/* SPDX-License-Identifier: Apache-2.0 */
#ifndef SAFETY_MONITOR_H
#define SAFETY_MONITOR_H
/** Monitors of the fast ISR: faults from one set of samples and a few counters, without side effects.
 *   over-current  any |i_x| > i_trip in one sample;          over-voltage  v_dc > v_max for 2 samples, or for 1 that
 *                 the two before it led to
 *   under-voltage v_dc < v_min for 10 samples;               current sum   |i_a + i_b + i_c| > sum_max for 5 samples
 *   angle         implausible samples of the angle, reported by the angle tracker: each adds 4 to a count, the first
 *                 after a good one 36 more, and a good one takes 1 away; at 30 ms of periods it is a fault
 * Source   docs/architecture.md, fault table; docs/theory/monitors.md (MN-21), (MN-49), (MN-50)
 * Units    per unit
 * Range    i_trip < 0.8: the trip comes before the converter saturates
 * Errors   returns the set of faults that are confirmed now; the fast ISR latches them
 * Context  fast ISR; no division, no loop */
#include <stdbool.h>
#include <stdint.h>

#include "fx/codegen.h"
#include "types/faults.h"
#include "types/frames.h"

/* Why monitor_step() must be called although the sample is normal. */
enum { MONITOR_COUNTING = 1, MONITOR_ANGLE_JUMP = 2, MONITOR_ANGLE_LOST = 4 /* the last sample was a jump */ };

/** q15 in a word each unless the name says otherwise. */
typedef struct {
    int32_t i_normal_squared_q30; /* (i_trip - sum_max/3)^2: no phase of a shorter vector exceeds i_trip */
    int32_t zero_sequence_max;    /* a third of sum_max */
    int32_t v_min, v_max;
    int32_t i_trip;
    int32_t sum_max;
    int32_t angle_count_max; /* not q15: 30 ms of periods */
} monitor_config_t;

typedef struct {
    uint8_t over_voltage, under_voltage, current_sum;
    uint8_t pending; /* MONITOR_...; 0: a normal sample needs no monitor_step() */
    uint16_t angle;
} monitor_state_t;

typedef struct {
    abc_q15_t i;
    int32_t v_dc; /* q15 */
} monitor_in_t;

/** True if monitor_step() would find nothing in this sample; unless a count is pending it need not be called. A phase
 * current is its projection of the vector plus a third of the phases' sum, so |i_x| <= |i| + |sum|/3. */
static inline bool monitor_is_sample_normal(const monitor_config_t *config, fx_pair_t i, int32_t zero_q28, int32_t v_dc)
{
    const fx_two_words_t current = FX_LOAD_TWO(config, i_normal_squared_q30, zero_sequence_max);
    const uint32_t largest = (uint32_t)current.second;
    if ((uint32_t)fx_dot2(i, i) >= (uint32_t)current.first || (uint32_t)(zero_q28 >> 13) + largest >= 2U * largest) {
        return false;
    }
    const fx_two_words_t v = FX_LOAD_TWO(config, v_min, v_max);
    return v_dc >= v.first && v_dc <= v.second;
}

/** The angle has jumped: monitor_step() must be called in this period. */
static inline void monitor_report_angle_jump(monitor_state_t *state)
{
    state->pending |= MONITOR_ANGLE_JUMP;
}

uint32_t monitor_step(const monitor_config_t *config, monitor_state_t *state, const monitor_in_t *in);

/** Whether the last two samples of the dc voltage before this one led to its over-voltage by a straight line (MN-49):
 * then the first sample confirms it. v_dc, last, before: q15. */
bool monitor_is_over_voltage_expected(const monitor_config_t *config, int32_t v_dc, int32_t last, int32_t before);

/** Whether the dc voltage rose faster between two samples than a link can (MN-50), so that the sensor is wrong. */
bool monitor_is_rise_of_sensor(const monitor_config_t *config, int32_t last, int32_t before);

#endif
