/* SPDX-License-Identifier: Apache-2.0 */
#ifndef ADAPT_DEAD_TIME_TRIM_H
#define ADAPT_DEAD_TIME_TRIM_H
/** Transfers the identified voltage error of the inverter slowly into the dead-time compensation, and reduces the
 * identified value by the same amount.
 *   w = pi/4 drop/v_dc;  after each second of identification: delta += w/16, at least 1 LSB, within base +- base/4
 *   drop -= 4/pi v_dc (delta_new - delta)
 * Source   docs/theory/dead-time-trim.md (DT-1) ... (DT-4)
 * Units    delta: duty, q15; drop: per unit of voltage as sigma x, x in Q27
 * Range    v_dc > 0, delta within 0 ... 1/8
 * Rounding delta in LSB of q15; x is corrected by the rounded change of delta, to 2^-27
 * Errors   delta stays while the drop's standard deviation exceeds half of its prior's; a delta that was set from
 *          outside becomes the new base
 * Context  1 kHz task; once per second three divisions */
#include <stdbool.h>

#include "fx/q.h"

typedef struct {
    q15_t base;     /* delta from motor data, commissioning or calibration */
    q15_t trim;     /* added by this stage */
    uint16_t steps; /* of identification since the last change */
} dead_time_trim_state_t;

typedef struct {
    q31_t sigma;          /* standard deviation of the drop's prior */
    int32_t x_q27;        /* the drop in sigma */
    int32_t variance_q30; /* of the drop, relative to sigma^2 */
    q15_t v_dc, dead_time;
    uint16_t period_steps; /* one second of identification */
    bool identifying;
} dead_time_trim_in_t;

typedef struct {
    q15_t dead_time;     /* for the modulation from now on */
    int32_t x_shift_q27; /* to be added to x at the same time */
} dead_time_trim_t;

dead_time_trim_t dead_time_trim_step(dead_time_trim_state_t *state, const dead_time_trim_in_t *in);
/** Replaces the trim by a stored one, limited. dead_time: the present compensation; returns the new one. */
q15_t dead_time_trim_restore(dead_time_trim_state_t *state, q15_t dead_time, int32_t trim);

#endif
