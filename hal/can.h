/* SPDX-License-Identifier: Apache-2.0 */
#ifndef HAL_CAN_H
#define HAL_CAN_H
/** One classic CAN channel. The port's receive interrupt only queues frames; it does not interpret them.
 * Source   docs/howto/port.md
 * Units    frames
 * Range    every classic frame
 * Errors   hal_can_receive(): false, nothing waits. hal_can_send(): false, all mailboxes are busy and the frame was
 *          not taken. hal_can_lost(): received frames that found the queue full, and hal_can_bus_off(): times the
 *          controller left the bus, both since start-up; the port recovers by itself
 * Context  1 kHz task and what runs below it */
#include <stdbool.h>
#include <stdint.h>

#include "types/can_frame.h"

bool hal_can_receive(can_frame_t *frame);
bool hal_can_send(const can_frame_t *frame);
uint32_t hal_can_lost(void);
uint32_t hal_can_bus_off(void);

#endif
