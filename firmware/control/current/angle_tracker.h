/* SPDX-License-Identifier: Apache-2.0 */
#ifndef CURRENT_ANGLE_TRACKER_H
#define CURRENT_ANGLE_TRACKER_H
/** Electrical angle and speed from a mechanical angle: second-order tracking loop.
 *   theta_e = p theta_m + offset;  e = theta_e - theta~;  w += k_i e;  theta~ += w + k_p e
 *   k_p = 2 w_n T_s, k_i = (w_n T_s)^2: both poles at -w_n (critical damping).
 *   |e| > max_step: the sample is implausible; the prediction replaces it and continues at the tracked speed
 * Source   docs/theory/angle-tracker.md (AT-1) ... (AT-4), (AT-14)
 * Units    angles in turns times 2^32, so that they wrap as an angle does; speed per unit of omega_b
 * Range    tracks up to |omega| < 2, omega_q31 saturates at 1; omega_b T_s < 0.78
 * Rounding half up: speed to 1 LSB of 2^-29, angle to 1 LSB of 2^-32 turn
 * Errors   none; a sample that is off by more than max_step is reported in jumped and counted by the monitor
 * Context  fast ISR; no division, no loop */
#include <stdbool.h>
#include <stdint.h>

#include "fx/q.h"

typedef struct {
    uint32_t pole_pairs;
    uint32_t offset; /* electrical, 2^32 = one turn */
    q31_t kp;
    int32_t ki_q29;     /* k_i 2 pi/(omega_b T_s): turns per period to per unit */
    int32_t pu_to_turn; /* omega_b T_s/(2 pi) 2^34: speed in Q30 to advance per period */
    uint32_t max_step;  /* largest plausible |e|, 2^32 = one turn */
    q16_t turn_to_pu;   /* pi/(omega_b T_s), the inverse of pu_to_turn: used for the first two samples only */
} angle_tracker_config_t;

typedef struct {
    uint32_t predicted; /* tracked electrical angle of the coming sample */
    int32_t omega_q30;
    uint8_t samples; /* taken so far, up to 2: the first two set angle and speed directly */
} angle_tracker_state_t;

typedef struct {
    uint32_t theta_e; /* measured electrical angle (not the tracked one: no lag) */
    int32_t step;     /* electrical advance per period */
    q31_t omega_q31;
    bool jumped;
} angle_t;

/** Takes any sample. From the third sample on, angle_tracker_follow() gives the same result without the check. */
angle_t angle_tracker_step(const angle_tracker_config_t *config, angle_tracker_state_t *state, uint32_t theta_m);
angle_t angle_tracker_follow(const angle_tracker_config_t *config, angle_tracker_state_t *state, uint32_t theta_m);

/** After a sample that jumped, in place of its result: what was predicted for it. The step of the loop is undone, and
 * the tracker continues at the speed before. theta_e: of the sample. */
angle_t angle_tracker_coast(const angle_tracker_config_t *config, angle_tracker_state_t *state, uint32_t theta_e);

#endif
