/* SPDX-License-Identifier: Apache-2.0 */
#ifndef SECOND_LEVEL_SECOND_LEVEL_H
#define SECOND_LEVEL_SECOND_LEVEL_H
/** The independent second level: compares the torque that it computes from the currents with the torque that it
 * permits from the received frames. It shares with the first level only the fixed-point library and the measured
 * samples, but no other code, no tables, references or limits. second_level_in_t holds what it takes from the first
 * level: whether the bridge switches, the calibrated slew, and the identified deviations of magnet and q axis.
 *   |mean of the own torque over some milliseconds| > bound + t_0 + share bound for `confirm_steps`: fault
 *   bound is that of the permitted torque in the same direction
 * Source   docs/theory/second-level.md (SL-6); docs/decisions/017-second-level.md
 * Units    per unit of the motor's bases
 * Range    every sample and every frame
 * Errors   true: confirmed now; the caller latches it
 * Context  1 kHz task, after the frames of the step */
#include "second_level/own_data.h"
#include "second_level/own_torque.h"
#include "second_level/permitted.h"

typedef struct {
    second_level_frames_t frames;
    second_level_permitted_t permitted;
    second_level_own_data_t own_data;
    int32_t mean_q8; /* own torque, first-order mean */
    uint32_t theta_m;
    int32_t confirmed_steps;
    uint32_t flow; /* signature of the parts of this step that have been passed */
} second_level_t;

typedef struct {
    second_level_sample_t sample;
    bool acting;  /* the bridge switches: otherwise the torque is the safe state's */
    int32_t slew; /* calibrated limit of the torque's change, per step */
    uint32_t elapsed_us;
    uint8_t question; /* of the external watchdog: the signature begins with it */
} second_level_in_t;

bool second_level_step(const second_level_constants_t *constants, second_level_t *level, const second_level_in_t *in);

#endif
