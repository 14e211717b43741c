/* SPDX-License-Identifier: Apache-2.0 */
#ifndef ADAPT_ANGLE_HARMONICS_H
#define ADAPT_ANGLE_HARMONICS_H
/** Adaptive correction of the angle sensor's first and second harmonic error per mechanical turn (LMS algorithm).
 *   d = theta[k] - 2 theta[k-1] + theta[k-2] of the corrected angle: at speed the rotor's inertia keeps the true second
 *     difference close to 0, so that d shows the remaining error of the sensor
 *   c_n += mu (d - a) cos(n theta[k-1]),  s_n += mu (d - a) sin(n theta[k-1]),  n = 1, 2;  |c|, |s| <= max
 *   mu = 1/64, but 1/16 between 1/16 and 1/8 turn per step: 3750 and 7500 rpm at 1 ms a step
 *   then a += (d - a)/16: the rotor's acceleration
 *   table[j] = sum of c_n cos(n t_j) + s_n sin(n t_j), t_j the middle of 64 equal parts of the turn
 * The fast ISR adds table[theta >> 26] to the measured angle.
 * Source   docs/theory/angle-tracker.md (AT-10) ... (AT-13), (AT-20)
 * Units    mechanical angles as fractions of a turn times 2^32
 * Range    every angle; adapts between 1/64 and 1/4 turn per step: 940 and 15 000 rpm at 1 ms a step
 * Rounding 1 LSB in 2^-16 turn of the step, half up; a is rounded down to 2^-21 turn
 * Errors   a |d| above 1/16 of the step means a late sample or a faulty sensor: no adaptation in this step
 *          coefficients that the memory has changed are reported
 * Context  1 kHz task; no division. table is read by the fast ISR word by word */
#include <stdbool.h>
#include <stdint.h>

#define ANGLE_HARMONICS_PARTS 64
#define ANGLE_HARMONICS_SHIFT 26
#define ANGLE_HARMONICS 4 /* coefficients: c_1, s_1, c_2, s_2 */

typedef struct {
    int32_t max; /* of each coefficient, below 2^24 */
} angle_harmonics_config_t;

typedef struct {
    uint32_t last, advance; /* angle of the last step, and its advance in that step */
    int32_t c[ANGLE_HARMONICS];
    uint8_t part;             /* of a quarter of the table, the next to be computed */
    bool damaged;             /* the seal did not match: the memory has changed a coefficient */
    int16_t acceleration_q21; /* mean second difference, 2^21 = one turn per step squared */
    uint32_t seal_complement; /* of the coefficients; 0 for a state of zeros */
} angle_harmonics_state_t;

void angle_harmonics_step(const angle_harmonics_config_t *config, angle_harmonics_state_t *state, uint32_t theta,
                          volatile int32_t table[ANGLE_HARMONICS_PARTS]);

#endif
