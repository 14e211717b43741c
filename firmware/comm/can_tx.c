/* SPDX-License-Identifier: Apache-2.0 */
#include "comm/can_tx.h"

#include "bus/signals.h"
#include "comm/e2e.h"

typedef struct {
    uint16_t id;
    uint16_t cycle_ms;
    uint16_t phase_ms; /* no two messages are due in the same millisecond */
    uint16_t data_id;  /* 0: not protected */
    message_encoder_t encode;
} tx_message_t;

static const tx_message_t messages[] = {
#define SENT(name, NAME) \
    {BUS_##NAME##_FRAME_ID, BUS_##NAME##_CYCLE_MS, BUS_##NAME##_PHASE_MS, BUS_##NAME##_DATA_ID, message_##name},
    BUS_SENT(SENT)
#undef SENT
};

#define MESSAGES (sizeof messages / sizeof messages[0])

_Static_assert(MESSAGES <= CAN_TX_MESSAGES_MAX, "each message has space for its counter");

void can_tx_begin(can_tx_t *tx, uint32_t passed_ms)
{
    tx->time_ms += passed_ms;
    tx->passed_ms = (uint8_t)passed_ms;
    tx->next = 0;
}

static bool is_due(const can_tx_t *tx, const tx_message_t *message)
{
    const uint32_t time_ms = tx->time_ms + message->cycle_ms - message->phase_ms; /* a cycle more: never negative */
    return time_ms % message->cycle_ms < tx->passed_ms;
}

bool can_tx_due(can_tx_t *tx)
{
    while (tx->next < MESSAGES && !is_due(tx, &messages[tx->next])) {
        tx->next++;
    }
    return tx->next < MESSAGES;
}

tx_result_t can_tx_next(can_tx_t *tx, const telemetry_t *telemetry, can_frame_t *frame)
{
    if (!can_tx_due(tx)) {
        return TX_NONE;
    }
    const tx_message_t *message = &messages[tx->next];
    tx->next++;
    *frame = (can_frame_t){.id = message->id, .length = MESSAGE_LENGTH};
    if (!message->encode(telemetry, frame->data)) {
        return TX_NOT_A_NUMBER;
    }
    if (message->data_id != 0U) {
        e2e_protect(message->data_id, &tx->counter[message - messages], frame);
    }
    return TX_FRAME;
}
