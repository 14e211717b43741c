/* SPDX-License-Identifier: Apache-2.0 */
#ifndef HAL_HOST_CAN_HOST_H
#define HAL_HOST_CAN_HOST_H
/** The bus side of a software-in-the-loop drive: an attached instance runs ecu_task_1khz() and takes its commands from
 * the bus, any other instance takes them from fluxtrue_set().
 *   Frames put wait in a queue of CAN_HOST_QUEUE until the next 1 kHz task, as in a port's receive interrupt; a frame
 *   that finds it full is lost and counted. Frames the ECU sent wait in a second one until they are taken.
 * Source   docs/howto/can.md; hal/can.h
 * Errors   false: the queue was full, or nothing waits
 * Context  between two periods; the same thread as fluxtrue_step() */
#include <stdbool.h>

#include "hal/host/fluxtrue.h"
#include "types/can_frame.h"

/** From now on commands come from the bus; the state machine starts in init. */
FLUXTRUE_API void can_host_attach(fluxtrue_t *drive);
FLUXTRUE_API bool can_host_put(fluxtrue_t *drive, const can_frame_t *frame);
FLUXTRUE_API bool can_host_take(fluxtrue_t *drive, can_frame_t *frame);

/* The ECU's end of the queues; for hal/host/port.c. */
bool can_host_receive(fluxtrue_t *drive, can_frame_t *frame);
bool can_host_send(fluxtrue_t *drive, const can_frame_t *frame);

#endif
