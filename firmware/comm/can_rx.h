/* SPDX-License-Identifier: Apache-2.0 */
#ifndef COMM_CAN_RX_H
#define COMM_CAN_RX_H
/** Reception of the protected messages, each with its checks, its age and its record of bad frames.
 *   A frame counts only if length, CRC and data id, counter and the range of every signal are right.
 *   alive   a frame was accepted less than the message's time-out ago
 *   failed  three of the last ten frames with this identifier were bad
 *   After a time-out the next frame only synchronises the counter, the one after it may be accepted.
 * Source   firmware/comm/fluxtrue.dbc; docs/howto/can.md; docs/decisions/018-bus-scales.md
 * Units    SI, as the DBC says
 * Range    accepted values lie within the DBC's ranges
 * Errors   one counter per kind of violation, saturating; a refused frame changes nothing else
 * Context  1 kHz task: can_rx_frame() for each frame, then can_rx_tick() once with the time since the last one */
#include "comm/e2e.h"
#include "types/bus_scales.h"

/* X(NAME, value, explanation): named and explained here only. */
#define COMMAND_MODE_LIST(X) \
    X(OFF, 0, "The dc link is discharged.") \
    X(TORQUE, 1, "The dc link is charged, ready for torque.") \
    X(CURRENT_LOCKED, 2, "Commissioning: refused on the bus.")

#define COMMAND_MODE_VALUE(name, value, text) COMMAND_MODE_##name = (value),
typedef enum { COMMAND_MODE_LIST(COMMAND_MODE_VALUE) } command_mode_t;
#undef COMMAND_MODE_VALUE

typedef struct {
    bool enable;
    bool fault_reset;
    command_mode_t mode;
    float torque_requested_Nm;
    float limit_drive_Nm, limit_regen_Nm; /* magnitudes */
} bus_command_t;

typedef struct {
    float drive_kW, regen_kW; /* magnitudes, at the dc terminals */
} bus_power_limits_t;

/** A movement of the shaft and the consent to voltage pulses for commissioning, in the raw values of the bus. */
typedef struct {
    uint8_t movement, direction, pole_pairs;
    bool reversed, damped, pulses;
    uint16_t offset;                                /* 2^16 = one electrical turn */
    int16_t current_d_permille, current_q_permille; /* of the largest current */
} bus_commission_t;

typedef enum {
    RX_ACCEPTED = 0,
    RX_SYNCED, /* the first frame: valid, but not used */
    RX_REPEATED,
    RX_JUMP,
    RX_CRC,
    RX_LENGTH,
    RX_RANGE,
    RX_ID,      /* the CRC of another protected message, or an extended identifier */
    RX_IGNORED, /* another identifier */
    RX_RESULTS
} rx_result_t;

/** One protected message. */
typedef struct {
    e2e_state_t e2e;
    uint32_t age_us;
    uint16_t bad; /* the last ten frames, one bit each */
    bool alive;
    bool failed;
    bool seen; /* accepted once since start-up */
} rx_channel_t;

typedef struct {
    rx_channel_t command_channel, limits_channel, commission_channel;
    bus_command_t command;       /* after a time-out: disabled, no torque, the mode stays */
    bus_power_limits_t limits;   /* after a time-out: zero */
    bus_commission_t commission; /* after a time-out: the last one, and its channel is not alive */
    float battery_V;             /* 0: not known; after a time-out the last one */
    uint16_t count[RX_RESULTS];
    uint16_t accepted; /* torque commands, wraps */
    uint16_t skipped;  /* frames of any message that were accepted although the frame before them was lost */
    uint16_t time_outs;
} can_rx_t;

rx_result_t can_rx_frame(can_rx_t *rx, const bus_scales_t *scales, const can_frame_t *frame);
void can_rx_tick(can_rx_t *rx, uint32_t elapsed_us);

#endif
