/* SPDX-License-Identifier: Apache-2.0 */
#include "hal/host/can_host.h"

#include "hal/host/instance.h"
#include "hal/host/port.h"

static bool put(can_queue_t *queue, const can_frame_t *frame)
{
    if (queue->put - queue->taken >= CAN_HOST_QUEUE) {
        return false;
    }
    queue->frames[queue->put % CAN_HOST_QUEUE] = *frame;
    queue->put++;
    return true;
}

static bool take(can_queue_t *queue, can_frame_t *frame)
{
    if (queue->put == queue->taken) {
        return false;
    }
    *frame = queue->frames[queue->taken % CAN_HOST_QUEUE];
    queue->taken++;
    return true;
}

void can_host_attach(fluxtrue_t *drive)
{
    drive->motor = *drive->data;
    ecu_init(&drive->ecu, &drive->motor);
    host_port_recall(drive);
    drive->on_bus = true;
}

bool can_host_put(fluxtrue_t *drive, const can_frame_t *frame)
{
    const bool taken = put(&drive->board.received, frame);
    drive->board.lost += taken ? 0U : 1U;
    return taken;
}

bool can_host_take(fluxtrue_t *drive, can_frame_t *frame)
{
    return take(&drive->board.sent, frame);
}

bool can_host_receive(fluxtrue_t *drive, can_frame_t *frame)
{
    return take(&drive->board.received, frame);
}

bool can_host_send(fluxtrue_t *drive, const can_frame_t *frame)
{
    return put(&drive->board.sent, frame);
}
