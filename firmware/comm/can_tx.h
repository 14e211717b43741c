/* SPDX-License-Identifier: Apache-2.0 */
#ifndef COMM_CAN_TX_H
#define COMM_CAN_TX_H
/** Schedule of the transmitted frames, with the cycle times of the DBC.
 *   Messages are spread over the milliseconds of their cycles: at most one frame is due in any of them.
 *   Message n is due when (time - phase) mod cycle = 0; phases are fixed, so that periods are exact. In a step of the
 *   task zero, one or two milliseconds pass; it sends the messages that were due in them.
 * Source   firmware/comm/fluxtrue.dbc, GenMsgCycleTime; docs/howto/can.md
 * Units    ms
 * Range    0 to 2 ms passed in a step
 * Errors   a frame with NaN or infinity is not sent; can_tx_next() then returns TX_NOT_A_NUMBER
 * Context  1 kHz task: can_tx_begin() once, then can_tx_next() until it returns TX_NONE */
#include "comm/messages.h"
#include "types/can_frame.h"

typedef enum { TX_NONE = 0, TX_FRAME, TX_NOT_A_NUMBER } tx_result_t;

#define CAN_TX_MESSAGES_MAX 16U

typedef struct {
    uint32_t time_ms;
    uint16_t pending;                     /* messages still to be checked in this step, one bit each */
    uint8_t passed_ms;                    /* in this step */
    uint8_t counter[CAN_TX_MESSAGES_MAX]; /* end-to-end protection of each message that has it */
} can_tx_t;

void can_tx_begin(can_tx_t *tx, uint32_t passed_ms);
/** Whether can_tx_next() will return a frame; it may be asked at any time in between. */
bool can_tx_due(can_tx_t *tx);
/** Whether this step may send these messages; otherwise what only they contain need not be collected. */
bool can_tx_may_send_temperatures(const can_tx_t *tx);
bool can_tx_may_send_identification(const can_tx_t *tx);
bool can_tx_may_send_status(const can_tx_t *tx);
bool can_tx_may_send_limits(const can_tx_t *tx);
bool can_tx_may_send_voltage_or_currents(const can_tx_t *tx);
bool can_tx_may_send_diagnostics(const can_tx_t *tx);
tx_result_t can_tx_next(can_tx_t *tx, const telemetry_t *telemetry, can_frame_t *frame);

#endif
