/* SPDX-License-Identifier: Apache-2.0 */
#ifndef CURRENT_ANGLE_TRACKER_H
#define CURRENT_ANGLE_TRACKER_H
/** Electrical angle and speed from a mechanical angle: second-order tracking loop.
 *   theta_e = p theta_m + offset;  e = theta_e - theta~;  w += k_i e;  theta~ += w + k_p e
 *   k_p = 2 w_n T_s, k_i = (w_n T_s)^2: both poles at -w_n (critical damping).
 *   |e| > max_step: the sample is implausible; the prediction replaces it and continues at the tracked speed
 *   A sensor that repeats one angle although the rotor turns is distinguished from a rotor that stops: a rotor that
 *   stops lags behind the prediction before it stands.
 * Source   docs/theory/angle-tracker.md (AT-1) ... (AT-4), (AT-14), (AT-16) ... (AT-18)
 * Units    angles in turns times 2^32, so that they wrap as an angle does; speed per unit of omega_b
 * Range    tracks up to |omega| < 2, omega_q31 saturates at 1; omega_b T_s < 0.78, with turn_shift 1 < 1.57
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
    int32_t ki_q29;         /* k_i 2 pi/(omega_b T_s): turns per period to per unit */
    int32_t pu_to_turn;     /* omega_b T_s/(2 pi) 2^34: speed in Q30 to advance per period */
    uint32_t max_step;      /* largest plausible |e|, 2^32 = one turn */
    q16_t turn_to_pu;       /* pi/(omega_b T_s), the inverse of pu_to_turn: used for the first two samples only */
    uint32_t repeat_max;    /* electrical advance during which a turning rotor's angle may repeat, 2^32 = one turn */
    uint32_t lag_steps;     /* lag behind the prediction, in steps, that precedes a standstill */
    int32_t stop_speed_q30; /* tracked speed up to which a rotor may be at rest after stop_periods (AT-18) */
    uint16_t stop_periods;  /* 5 ms: in which a rotor of up to stop_speed can stop */
    uint16_t turn_shift;    /* pu_to_turn is 2^turn_shift smaller; not 0: only angle_tracker_step() may be used */
} angle_tracker_config_t;

/** What repeated readings of an angle show: not decided yet, a failed sensor, or a rotor at standstill. */
typedef enum { REPEATS_UNDECIDED, REPEATS_OF_SENSOR, REPEATS_OF_ROTOR } repeat_cause_t;

typedef struct {
    uint32_t predicted; /* tracked electrical angle of the coming sample */
    int32_t omega_q30;
    uint32_t theta_m;       /* of the last sample */
    uint32_t repeat_period; /* number of the last period in which it was repeated */
    uint32_t repeats;       /* in a row; saturates */
    uint8_t samples;        /* taken so far, up to 2: the first two set angle and speed directly */
    repeat_cause_t cause;   /* decided once in a row */
} angle_tracker_state_t;

typedef struct {
    uint32_t theta_e; /* measured electrical angle (not the tracked one: no lag) */
    int32_t step;     /* electrical advance per period, 2^32 = one turn */
    q31_t omega_q31;
    bool jumped;
} angle_t;

/** Takes any sample. From the third sample on and without a turn_shift, angle_tracker_follow() gives the same result
 * without the checks. */
angle_t angle_tracker_step(const angle_tracker_config_t *config, angle_tracker_state_t *state, uint32_t theta_m);
angle_t angle_tracker_follow(const angle_tracker_config_t *config, angle_tracker_state_t *state, uint32_t theta_m);

/** The sensor's zero has moved, not the rotor: from the next sample on theta_m is larger by this part of a turn. */
static inline void angle_tracker_move(const angle_tracker_config_t *config, angle_tracker_state_t *state, uint32_t by)
{
    state->theta_m += by;
    state->predicted += config->pole_pairs * by;
}

/** After a sample that jumped: returns the prediction in its place. The loop's step for this sample is undone, and the
 * tracker continues at the speed before it. theta_e: electrical angle of the sample. */
angle_t angle_tracker_coast(const angle_tracker_config_t *config, angle_tracker_state_t *state, uint32_t theta_e);

/** What a repeated reading of the sensor means. */
typedef enum {
    ANGLE_FOLLOWED, /* the rotor stands, or turns by less than the sensor resolves */
    ANGLE_STUCK,    /* the rotor turns: the sample is implausible */
    ANGLE_STANDING  /* it has come to a standstill: *angle is that of a rotor at rest, and so is the tracker */
} angle_repeat_t;

/** After a reading that equals the last one. period: counts periods. angle: the result for this sample. A stuck sample
 * counts as a fault only at a speed at which angle_tracker_may_stop() says no. */
angle_repeat_t angle_tracker_repeated(const angle_tracker_config_t *config, angle_tracker_state_t *state,
                                      angle_t *angle, uint32_t period);

/** Whether the tracked speed is high enough for a stuck angle to be found within stop_periods. */
bool angle_tracker_may_stick(const angle_tracker_config_t *config, const angle_tracker_state_t *state);

/** Whether a rotor at the tracked speed may be at rest within stop_periods. */
bool angle_tracker_may_stop(const angle_tracker_config_t *config, const angle_tracker_state_t *state);

#endif
