/* SPDX-License-Identifier: Apache-2.0 */
#ifndef HAL_S32K144_TRAVEL_H
#define HAL_S32K144_TRAVEL_H
/** Angle at the sampling instant of the currents, from a sensor that is sampled once a period at another instant; an
 * invalid sample is replaced by a prediction.
 *   valid sample:    travel = now - last, if the period before was valid, too;  last = now
 *   invalid sample:  last = last + travel
 *   share = travel sampled_q32/2^32: what the rotor travels in the part of a period between the two instants
 * Source   README.md, angle
 * Units    angles: fraction of a turn, 2^32 = one; sampled_q32: fraction of a PWM period, 2^32 = one
 * Range    any angle; sampled_q32: [0, 2^31), less than half a period; travel: less than half a turn per period
 * Rounding travel_share(): truncated, below one unit
 * Errors   travel_is_lost(): TRAVEL_INVALID_MAX samples in a row were invalid
 * Context  fast ISR; no division, no loop */
#include <stdbool.h>
#include <stdint.h>

#include "fx/q.h"

#define TRAVEL_INVALID_MAX 3U /* periods in a row that are the angle fault */

typedef struct {
    uint32_t last;       /* angle of the period before */
    int32_t travel;      /* from one period to the next */
    int32_t sampled_q32; /* from the instant of the sample to that of the currents, or the reverse, in periods */
    uint16_t invalid;    /* in a row */
} travel_t;

/** One invalid sample; angle_errors.invalid counts them. */
void travel_predict(travel_t *sensor);

/** One valid sample. It gives the travel per period only if now and last are one period apart (`consecutive`). */
static inline void travel_take(travel_t *sensor, uint32_t now, bool consecutive)
{
    if (consecutive && sensor->invalid == 0U) {
        sensor->travel = (int32_t)(now - sensor->last);
    }
    sensor->last = now;
    sensor->invalid = 0;
}

static inline uint32_t travel_share(const travel_t *sensor)
{
    return (uint32_t)fx_mulhi(sensor->travel, sensor->sampled_q32);
}

static inline bool travel_is_lost(const travel_t *sensor)
{
    return sensor->invalid >= TRAVEL_INVALID_MAX;
}

#endif
