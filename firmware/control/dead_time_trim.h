/* SPDX-License-Identifier: Apache-2.0 */
#ifndef CONTROL_DEAD_TIME_TRIM_H
#define CONTROL_DEAD_TIME_TRIM_H
/** Moves what is learnt of the inverter's voltage error into the dead-time compensation, slowly, and takes it out of
 *   the identification by the same amount.
 *   w = pi/4 drop/v_dc;  each second of learning: delta += w/16, 1 LSB at least, within base +- base/4
 *   drop -= 4/pi v_dc (delta_new - delta)
 * Source   docs/theory/dead-time-trim.md (DT-1) ... (DT-4)
 * Units    delta: duty, q15; drop: per unit of voltage as sigma x, x in Q27
 * Range    v_dc > 0, delta within 0 ... 1/8
 * Rounding delta in LSB of q15; x to 2^-27 of what delta really moved
 * Errors   a drop that is not known to half of its prior's deviation moves nothing; a delta that somebody else has set
 *          becomes the new base
 * Context  1 kHz task; once per second three divisions */
#include <stdbool.h>

#include "fx/q.h"

typedef struct {
    q15_t base;  /* delta as it was given: motor data, commissioning or calibration */
    q15_t trim;  /* what this stage has added */
    uint16_t ms; /* of learning since the last move */
} dead_time_trim_state_t;

typedef struct {
    q31_t sigma;          /* of the drop's prior */
    int32_t x, variance;  /* of the drop: Q27, Q30 */
    q15_t v_dc, dead_time;
    bool learning;
} dead_time_trim_in_t;

typedef struct {
    q15_t dead_time; /* to act from now on */
    int32_t x_shift; /* to be added to x at the same time, Q27 */
} dead_time_trim_t;

dead_time_trim_t dead_time_trim_step(dead_time_trim_state_t *state, const dead_time_trim_in_t *in);
/** A trim that was kept, in place of the present one, limited; dead_time is what acts, the answer what is to act. */
q15_t dead_time_trim_restore(dead_time_trim_state_t *state, q15_t dead_time, int32_t trim);

#endif
