/* SPDX-License-Identifier: Apache-2.0 */
#ifndef SAFETY_PLAUSIBILITY_H
#define SAFETY_PLAUSIBILITY_H
/** Slow monitors: does the machine do what it was told, as far as its sensors tell?
 *   control deviation  |i - i*| > e_0 + |i*|/8 for 20 ms, 100 ms while the voltage is cut
 *   phase lost         a phase without current that should carry some: 10 more such samples than samples with current
 *   sensor stuck       20 equal samples of a phase, both others moved by i_dead/4 in each
 *   over-speed         |w| > w_trip for 5 ms
 *   over-temperature   110 ms beyond the end of a derating line
 * Source   docs/theory/monitors.md (MN-1) ... (MN-5)
 * Units    per unit; temperatures in tenths of a degree C, INT16_MIN: unknown
 * Range    every argument
 * Errors   returns the set of faults that are confirmed now; latching is app's business
 * Context  1 kHz task; one square root per vector length, no division */
#include <stdbool.h>
#include <stdint.h>

#include "types/frames.h"

typedef struct {
    q15_t e_0;                       /* deviation allowed at no current */
    q15_t i_dead;                    /* a phase below it carries nothing */
    q15_t i_alive;                   /* a phase that should carry this much is missed */
    q15_t omega_trip;
    int16_t inverter_trip_dC, winding_trip_dC;
} plausibility_config_t;

typedef struct {
    int16_t deviation;
    int8_t lost[3];
    uint8_t equal[3];
    abc_t last;
    uint8_t fast, hot;
} plausibility_state_t;

typedef struct {
    bool acting;          /* the bridge follows its references */
    bool voltage_limited;
    dq_t i, i_ref;        /* the reference that acted until now */
    abc_t phases;         /* measured */
    abc_t wanted;         /* i_ref in the phases, at the instant of the samples */
    q15_t omega;
    int16_t inverter_dC, winding_dC;
} plausibility_in_t;

uint32_t plausibility_step(const plausibility_config_t *config, plausibility_state_t *state,
                           const plausibility_in_t *in);

#endif
