/* SPDX-License-Identifier: Apache-2.0 */
#ifndef SAFETY_PLAUSIBILITY_H
#define SAFETY_PLAUSIBILITY_H
/** Slow monitors: currents, speed and temperatures are compared with the references and with their limits.
 *   control deviation  |i - i*| > e_0 + |i*|/8 for 20 ms, for 100 ms while the voltage is limited
 *   oscillation        mean of |i - i* - mean(i - i*)| over 16 ms above ripple_max for 20 ms; i is the sample or the
 *                      mean of a step, whichever is further off; each deviation limited to 4 ripple_max
 *   phase lost         i_x <= i_dead in the direction of i_x*, |i_x*| > max(i_alive, |i*|/8) + behind_gain u_behind: 8
 *                      more such samples than samples with current, each direction counted by itself
 *   sensor stuck       20 samples of a phase, equal within 4 LSB, while the sum of the others changes by more than
 *                      i_dead/4 in each
 *   mismatch           the d-axis voltage contradicts the currents, the speed and the identified machine for 70 ms
 *   over-speed         |w| > w_trip for 5 ms
 *   over-temperature   110 ms beyond the end of a derating line
 *   zero               at rest with switching disabled, a phase current above zero_error_max in 50 more steps than
 *                      below it
 *   reference          a known voltage is read more than 6 % wrong in 10 steps
 *   These times are counted in steps of the task, rounded up.
 * Source   docs/theory/monitors.md (MN-1) ... (MN-5), (MN-11), (MN-12), (MN-37), (MN-38), (MN-43)
 * Units    per unit; temperatures in tenths of a degree C, or TEMPERATURE_UNKNOWN
 * Range    every argument
 * Errors   returns the set of faults that are confirmed now; the fast ISR latches them
 * Context  1 kHz task; one square root per vector length, no division */
#include <stdbool.h>
#include <stdint.h>

#include "types/frames.h"

typedef struct {
    q15_t e_0;     /* deviation allowed at no current */
    q15_t i_dead;  /* a phase current up to this counts as none */
    q15_t i_alive; /* a phase whose reference exceeds this must carry current */
    q15_t ripple_max;
    q15_t zero_error_max; /* of a phase current that cannot flow */
    q15_t answer_rate;    /* share of a change of the reference that the current follows in a step; Q15_MAX: all */
    q16_t behind_gain;    /* current per rotational voltage that is missing */
    q15_t omega_trip;
    int16_t inverter_trip_dC, winding_trip_dC;
    int16_t deviation_steps;     /* 100 ms: a step counts once while the voltage is limited, else five times */
    uint8_t gate_exceeded_steps; /* 70 ms */
    uint8_t ripple_steps, lost_steps, equal_steps, fast_steps, hot_steps; /* 20, 8, 20, 5, 110 ms */
} plausibility_config_t;

typedef struct {
    int16_t deviation;
    dq_q15_t expected;           /* the reference as the current follows it */
    dq_q15_t sample_x8, step_x8; /* mean deviation of samples and of means over 8 steps, times 8 */
    int32_t ripple_x16;          /* mean distance from it over 16 steps, times 16 */
    int8_t lost[3][2];           /* of each phase, in the positive and in the negative direction */
    uint8_t equal[3];
    uint8_t not_zero;
    abc_q15_t last;
    uint8_t oscillating, fast, hot, reference;
} plausibility_state_t;

typedef struct {
    bool acting;  /* the bridge follows its references */
    bool at_rest; /* switching is disabled and the rotor stands: no current can flow */
    bool voltage_limited;
    dq_q15_t i, i_ref;    /* measured, and the reference in effect until now */
    dq_q15_t i_mean;      /* of the last step; the sample if there is none */
    abc_q15_t phases;     /* measured */
    q15_t u_behind;       /* rotational voltage that is missing because the tracked speed is behind the rotor's */
    abc_q15_t phases_ref; /* plausibility_expected() as phase currents at the instant of the samples */
    q15_t omega;
    int16_t inverter_dC, winding_dC;
    int16_t known_permille;      /* of a known voltage, as the converters read it; negative: there is none */
    uint8_t gate_exceeded_steps; /* in a row, as the identification reports them */
} plausibility_in_t;

/** The reference as the current follows it in this step. Where the field turns far in a period, current control answers
 * so slowly (CC-21) that a slope of the torque would look like a deviation, and near zero like a phase without current.
 * Before plausibility_step(). */
dq_q15_t plausibility_expected(const plausibility_config_t *config, const plausibility_state_t *state, dq_q15_t i_ref);
uint32_t plausibility_step(const plausibility_config_t *config, plausibility_state_t *state,
                           const plausibility_in_t *in);

#endif
