/* SPDX-License-Identifier: Apache-2.0 */
#ifndef DRIVE_MOVEMENT_H
#define DRIVE_MOVEMENT_H
/** A movement of the uncoupled shaft for commissioning: the frame in which the currents are controlled, the bounds of
 * the currents, and what ends the movement.
 *   imposed     theta_e += f T_s: the currents do not turn with the rotor; f is -1, 0 or 1 Hz, reached with a slope
 *   spin        theta_e = +-p theta_m + offset, with currents instead of a torque
 *   connected   the same angle with the torque path: for the steps at standstill of a motor whose sensor is not
 *               connected as the motor data say
 * Damping: the rotor swings about the imposed current. While it accelerates, only a fifth of the current flows.
 * Source   docs/theory/commissioning.md (CM-15), section 11
 * Units    angles in turns times 2^32, currents per unit in q15, sensor speed per unit of the speed base in Q31
 * Range    pole pairs up to MOVEMENT_PAIRS_MAX; currents are cut at i_max, and change by at most i_slew in a step
 * Errors   movement_failure_t: the caller disables switching
 * Context  movement_frame_step(): fast ISR, outside the usual route; movement_step(): 1 kHz task */
#include <stdbool.h>
#include <stdint.h>

#include "fx/q.h"
#include "types/frames.h"

#define MOVEMENT_PAIRS_MAX 50U

/* X(NAME, value, explanation): named and explained here only. */
#define MOVEMENT_LIST(X) \
    X(NONE, 0, "The shaft shall not move.") \
    X(IMPOSED, 1, "The current turns slowly, whatever the rotor does.") \
    X(SPIN, 2, "The currents follow the rotor with the connection in this message.") \
    X(CONNECTED, 3, "The torque request acts with the connection in this message.")

#define MOVEMENT_DIRECTION_LIST(X) \
    X(STAND, 0, "The imposed angle stands.") \
    X(FORWARD, 1, "The imposed angle grows by one electrical turn in a second.") \
    X(BACKWARD, 2, "The imposed angle falls by one electrical turn in a second.")

#define MOVEMENT_PHASE_LIST(X) \
    X(IDLE, 0, "No movement is agreed.") \
    X(AGREED, 1, "A movement is agreed; it begins when switching is enabled.") \
    X(ENDED, 2, "The movement has ended early; the failure says why.")

#define MOVEMENT_FAILURE_LIST(X) \
    X(GOOD, 0, "No failure.") \
    X(REFUSED, 1, "Switching was enabled, there was a request, or a value was out of its range.") \
    X(SILENT, 2, "No command has prolonged the movement in time.") \
    X(FAST, 3, "The shaft turned faster than 30 % of its largest speed.") \
    X(BLOCKED, 4, "The shaft did not turn although a current makes torque: it is blocked or coupled.") \
    X(LONG, 5, "The movement took longer than a minute.") \
    X(STOPPED, 6, "A fault has disabled switching, or a torque was requested.")

#define MOVEMENT_VALUE(name, value, text) MOVEMENT_##name = (value),
#define MOVEMENT_PHASE_VALUE(name, value, text) MOVEMENT_PHASE_##name = (value),
#define MOVEMENT_FAILURE_VALUE(name, value, text) MOVEMENT_FAILURE_##name = (value),
enum { MOVEMENT_LIST(MOVEMENT_VALUE) };           /* the kind, kept in one byte */
enum { MOVEMENT_DIRECTION_LIST(MOVEMENT_VALUE) }; /* of the imposed angle, kept in one byte */
typedef enum { MOVEMENT_PHASE_LIST(MOVEMENT_PHASE_VALUE) } movement_phase_t;
typedef enum { MOVEMENT_FAILURE_LIST(MOVEMENT_FAILURE_VALUE) } movement_failure_t;
#undef MOVEMENT_VALUE
#undef MOVEMENT_PHASE_VALUE
#undef MOVEMENT_FAILURE_VALUE

/** The requested movement. */
typedef struct {
    uint8_t movement;   /* the kind */
    uint8_t pole_pairs; /* electrical turns of a turn of the sensor, from 1 */
    uint8_t direction;  /* of the imposed angle */
    bool reversed;      /* the sensor counts against the electrical direction */
    bool damped;
    bool alive;      /* the message of the movement has not timed out */
    bool may_begin;  /* the state machine allows a movement to begin */
    uint16_t offset; /* electrical angle at the sensor's zero, 2^16 = one turn */
    dq_q15_t i;
} movement_request_t;

typedef struct {
    q15_t i_max;            /* of each axis */
    q15_t i_slew;           /* per step */
    q15_t i_blocked;        /* i_q that turns every uncoupled shaft */
    q31_t omega_max;        /* of the sensor */
    q31_t omega_still;      /* below: the shaft does not turn */
    int32_t rate_max;       /* of the imposed angle, per period */
    int32_t rate_slew;      /* per step */
    uint16_t blocked_steps; /* in which i_blocked must have turned the shaft */
    uint32_t steps_max;     /* of a movement */
} movement_config_t;

/** The frame of the currents. Written by the task. */
typedef struct {
    int32_t pole_pairs; /* negative: reversed; 0: the angle is imposed */
    int32_t ratio_q25;  /* pole_pairs by those of the motor data */
    uint32_t offset;
    int32_t rate; /* of the imposed angle, per period */
} movement_frame_t;

/** Written by the fast ISR alone. */
typedef struct {
    uint32_t imposed;   /* electrical */
    q31_t omega_sensor; /* with the pole pairs of the motor data */
} movement_angle_t;

typedef struct {
    uint32_t theta_m;
    int32_t step; /* electrical advance per period, with the pole pairs of the motor data */
    q31_t omega;
} movement_sensor_t;

/** Angle, advance per period and speed of the frame. */
typedef struct {
    uint32_t theta_e;
    int32_t step;
    q31_t omega;
} movement_frame_motion_t;

typedef struct {
    movement_phase_t phase;
    movement_failure_t failure; /* of the last movement, until the next one begins */
    uint8_t movement;           /* that is agreed */
    uint8_t swing_steps;        /* of the present interval of the damping */
    bool weak;                  /* a fifth of the current flows */
    uint16_t blocked;           /* steps in a row */
    uint32_t steps;             /* with switching enabled */
    uint32_t theta_m;           /* at the start of the interval */
    uint32_t moved;             /* in the interval before it */
    dq_q15_t i_ref;
} movement_state_t;

typedef struct {
    bool runs;        /* switching is enabled */
    bool has_failed;  /* a fault is latched, or the identification is not the robust one */
    bool has_request; /* more torque than the movement allows */
    uint32_t theta_m;
    q31_t omega; /* of the sensor */
} movement_in_t;

movement_frame_motion_t movement_frame_step(const movement_frame_t *frame, movement_angle_t *angle,
                                            const movement_sensor_t *sensor);

/** Begins, continues or ends the requested movement, and computes the frame and state->i_ref. */
void movement_step(const movement_config_t *config, uint32_t pole_pairs, movement_state_t *state,
                   movement_frame_t *frame, const movement_request_t *request, const movement_in_t *in);

static inline bool movement_is_agreed(const movement_state_t *state)
{
    return state->phase == MOVEMENT_PHASE_AGREED;
}

/** The currents do not turn with the sensor's angle, which may be unknown. */
static inline bool movement_imposes_angle(const movement_state_t *state)
{
    return movement_is_agreed(state) && state->movement == (uint8_t)MOVEMENT_IMPOSED;
}

/** Currents act in place of a torque request. */
static inline bool movement_moves(const movement_state_t *state)
{
    return movement_is_agreed(state) && state->movement != (uint8_t)MOVEMENT_CONNECTED;
}

#endif
