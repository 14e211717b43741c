/* SPDX-License-Identifier: Apache-2.0 */
#include "comm/can_tx.h"

#include "bus/signals.h"
#include "comm/e2e.h"
#include "fx/format.h"

#define SLOTS 10U /* milliseconds */

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

/* Every cycle is a multiple of ten milliseconds, so a message can be due only in the milliseconds that have the last
 * digit of its phase. For each digit: one bit for each of its messages, in the order of the list. */
enum {
#define NUMBER(name, NAME) NUMBER_##name,
    BUS_SENT(NUMBER)
#undef NUMBER
};
#define IN_SLOT(slot, name, NAME) | (BUS_##NAME##_PHASE_MS % SLOTS == (slot) ? 1U << NUMBER_##name : 0U)
#define IN_0(name, NAME) IN_SLOT(0U, name, NAME)
#define IN_1(name, NAME) IN_SLOT(1U, name, NAME)
#define IN_2(name, NAME) IN_SLOT(2U, name, NAME)
#define IN_3(name, NAME) IN_SLOT(3U, name, NAME)
#define IN_4(name, NAME) IN_SLOT(4U, name, NAME)
#define IN_5(name, NAME) IN_SLOT(5U, name, NAME)
#define IN_6(name, NAME) IN_SLOT(6U, name, NAME)
#define IN_7(name, NAME) IN_SLOT(7U, name, NAME)
#define IN_8(name, NAME) IN_SLOT(8U, name, NAME)
#define IN_9(name, NAME) IN_SLOT(9U, name, NAME)
static const uint16_t in_slot[SLOTS] = {
    0U BUS_SENT(IN_0), 0U BUS_SENT(IN_1), 0U BUS_SENT(IN_2), 0U BUS_SENT(IN_3), 0U BUS_SENT(IN_4),
    0U BUS_SENT(IN_5), 0U BUS_SENT(IN_6), 0U BUS_SENT(IN_7), 0U BUS_SENT(IN_8), 0U BUS_SENT(IN_9),
};
#define REST(name, NAME) | (BUS_##NAME##_CYCLE_MS % SLOTS)
_Static_assert((0U BUS_SENT(REST)) == 0U, "whole tens of milliseconds");

void can_tx_begin(can_tx_t *tx, uint32_t passed_ms)
{
    tx->pending = 0;
    for (uint32_t n = 0; n < passed_ms; n++) {
        tx->time_ms++;
        tx->pending |= in_slot[tx->time_ms % SLOTS];
    }
    tx->passed_ms = (uint8_t)passed_ms;
}

static bool is_due(const can_tx_t *tx, const tx_message_t *message)
{
    const uint32_t time_ms = tx->time_ms + message->cycle_ms - message->phase_ms; /* a cycle more: never negative */
    return time_ms % message->cycle_ms < tx->passed_ms;
}

/* The first message that is pending. */
static const tx_message_t *next(const can_tx_t *tx)
{
    const uint32_t lowest = tx->pending & (0U - tx->pending);
    return &messages[31U - fx_leading_zeros(lowest)];
}

static void drop_first(can_tx_t *tx)
{
    tx->pending = (uint16_t)(tx->pending & (tx->pending - 1U));
}

bool can_tx_due(can_tx_t *tx)
{
    while (tx->pending != 0U && !is_due(tx, next(tx))) {
        drop_first(tx);
    }
    return tx->pending != 0U;
}

static uint32_t bit_of(uint32_t number)
{
    return 1U << number;
}

static bool is_pending(const can_tx_t *tx, uint32_t of_messages)
{
    return ((uint32_t)tx->pending & of_messages) != 0U;
}

bool can_tx_may_send_temperatures(const can_tx_t *tx)
{
    return is_pending(tx, bit_of(NUMBER_inv_temperatures));
}

bool can_tx_may_send_identification(const can_tx_t *tx)
{
    return is_pending(tx, bit_of(NUMBER_inv_identification));
}

bool can_tx_may_send_status(const can_tx_t *tx)
{
    return is_pending(tx, bit_of(NUMBER_inv_status));
}

bool can_tx_may_send_limits(const can_tx_t *tx)
{
    return is_pending(tx, bit_of(NUMBER_inv_limits));
}

bool can_tx_may_send_voltage_or_currents(const can_tx_t *tx)
{
    return is_pending(tx, bit_of(NUMBER_inv_dc_link) | bit_of(NUMBER_inv_currents));
}

bool can_tx_may_send_diagnostics(const can_tx_t *tx)
{
    return is_pending(tx, bit_of(NUMBER_inv_diag_protection) | bit_of(NUMBER_inv_diag_receive) |
                              bit_of(NUMBER_inv_diag_bus) | bit_of(NUMBER_inv_diag_task));
}

tx_result_t can_tx_next(can_tx_t *tx, const telemetry_t *telemetry, can_frame_t *frame)
{
    if (!can_tx_due(tx)) {
        return TX_NONE;
    }
    const tx_message_t *message = next(tx);
    drop_first(tx);
    *frame = (can_frame_t){.id = message->id, .length = MESSAGE_LENGTH};
    if (!message->encode(telemetry, frame->data)) {
        return TX_NOT_A_NUMBER;
    }
    if (message->data_id != 0U) {
        e2e_protect(message->data_id, &tx->counter[message - messages], frame);
    }
    return TX_FRAME;
}
