/* SPDX-License-Identifier: Apache-2.0 */
#include "hal/can.h"

/* Write: take the oldest frame from the queue (32 frames) that the receive interrupt fills; false if it is empty. */
bool hal_can_receive(can_frame_t *frame)
{
    (void)frame;
    return false;
}

/* Write: put the frame into a free mailbox; false if there is none. */
bool hal_can_send(const can_frame_t *frame)
{
    (void)frame;
    return false;
}

/* Write: the number of received frames since start-up that found the queue full. */
uint32_t hal_can_lost(void)
{
    return 0;
}

/* Write: how often the controller has left the bus since start-up. Recovery is the port's task. */
uint32_t hal_can_bus_off(void)
{
    return 0;
}
