/* SPDX-License-Identifier: Apache-2.0 */
#ifndef COMM_CAN_TAKE_H
#define COMM_CAN_TAKE_H
/** The content of a protected frame whose protection is right.
 * Source   firmware/comm/fluxtrue.dbc; docs/howto/can.md
 * Units    SI, as the DBC says; of the movement the raw values
 * Range    every frame of eight bytes
 * Errors   false: a signal is out of its range, nothing has changed
 * Context  1 kHz task; the identifier is one of those that are received */
#include "comm/can_rx.h"

bool can_take(can_rx_t *rx, const bus_scales_t *scales, const can_frame_t *frame);

#endif
