/* SPDX-License-Identifier: Apache-2.0 */
#ifndef COMM_CAN_TX_H
#define COMM_CAN_TX_H
/** Which frame is due in which millisecond, in the cycle times of the DBC.
 *   Messages of one cycle time are spread over its milliseconds: at most two frames are due in any of them.
 *   Message n is due when (time - phase) mod cycle = 0; phases are fixed, so that periods are exact. A step of the task
 *   sends what was due in the milliseconds that have passed in it: none, one or two.
 * Source   firmware/comm/fluxtrue.dbc, GenMsgCycleTime; docs/howto/can.md
 * Units    ms
 * Errors   a frame that cannot be encoded is left out; can_tx_next() says so
 * Context  1 kHz task: can_tx_begin() once, then can_tx_next() until it answers TX_NONE */
#include "comm/messages.h"
#include "types/can_frame.h"

typedef enum { TX_NONE = 0, TX_FRAME, TX_NOT_A_NUMBER } tx_result_t;

typedef struct {
    uint32_t time_ms;
    uint8_t passed_ms;      /* in this step */
    uint8_t next;           /* message looked at next in this step */
    uint8_t status_counter; /* end-to-end protection of INV_Status */
} can_tx_t;

void can_tx_begin(can_tx_t *tx, uint32_t passed_ms);
tx_result_t can_tx_next(can_tx_t *tx, const telemetry_t *telemetry, can_frame_t *frame);

#endif
