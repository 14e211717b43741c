/* SPDX-License-Identifier: Apache-2.0 */
#include "comm/can_rx.h"

#include <stddef.h>

#include "bus/signals.h"
#include "comm/can_take.h"
#include "signal/counter.h"

#define WINDOW_MASK 0x3FFU /* ten frames */
#define BAD_TO_FAIL 3U

static const uint16_t data_ids[] = {
#define DATA_ID(name, NAME) BUS_##NAME##_DATA_ID,
    BUS_PROTECTED(DATA_ID)
#undef DATA_ID
};

/* A CRC that is wrong for this message but right for another one shows that the identifier is wrong. */
static bool has_crc_of_another_message(const can_frame_t *frame)
{
    for (unsigned n = 0; n < sizeof data_ids / sizeof data_ids[0]; n++) {
        if (frame->data[0] == e2e_crc(data_ids[n], frame)) {
            return true;
        }
    }
    return false;
}

static rx_result_t check_protection(uint16_t data_id, rx_channel_t *channel, const can_frame_t *frame)
{
    switch (e2e_check(data_id, &channel->e2e, frame)) {
    case E2E_OK:
    case E2E_SKIPPED:
        return RX_ACCEPTED;
    case E2E_FIRST:
        return RX_SYNCED;
    case E2E_REPEATED:
        return RX_REPEATED;
    case E2E_JUMP:
        return RX_JUMP;
    case E2E_CRC:
        return has_crc_of_another_message(frame) ? RX_ID : RX_CRC;
    case E2E_WRONG_LENGTH:
    default:
        return RX_LENGTH;
    }
}

static unsigned count_ones(unsigned bits)
{
    unsigned sum = 0;
    for (; bits != 0U; bits &= bits - 1U) {
        sum++;
    }
    return sum;
}

/* The first frame only synchronises the counter: it counts neither as good nor as bad. */
static void record_result(rx_channel_t *channel, rx_result_t result)
{
    if (result == RX_ACCEPTED) {
        channel->age_us = 0;
        channel->alive = true;
        channel->seen = true;
    }
    if (result != RX_SYNCED) {
        const unsigned bad = (result != RX_ACCEPTED) ? 1U : 0U;
        channel->bad = (uint16_t)(((unsigned)channel->bad << 1 | bad) & WINDOW_MASK);
        channel->failed = count_ones(channel->bad) >= BAD_TO_FAIL;
    }
}

/* The channel of an identifier; NULL: it is not one of the protected messages. */
static rx_channel_t *channel_of(can_rx_t *rx, uint32_t id, uint16_t *data_id)
{
    switch (id) {
    case BUS_VCU_TORQUE_REQUEST_FRAME_ID:
        *data_id = BUS_VCU_TORQUE_REQUEST_DATA_ID;
        return &rx->command_channel;
    case BUS_VCU_BATTERY_LIMITS_FRAME_ID:
        *data_id = BUS_VCU_BATTERY_LIMITS_DATA_ID;
        return &rx->limits_channel;
    case BUS_VCU_COMMISSION_FRAME_ID:
        *data_id = BUS_VCU_COMMISSION_DATA_ID;
        return &rx->commission_channel;
    default:
        return NULL;
    }
}

static rx_result_t receive(can_rx_t *rx, const bus_scales_t *scales, const can_frame_t *frame)
{
    uint16_t data_id;
    rx_channel_t *channel = channel_of(rx, frame->id, &data_id);
    if (channel == NULL) {
        return RX_IGNORED;
    }
    if (frame->extended) {
        return RX_ID; /* a frame of another sender */
    }
    const uint8_t before = channel->e2e.counter;
    rx_result_t result = check_protection(data_id, channel, frame);
    if (result == RX_ACCEPTED) {
        const bool next = (before + 1U) % E2E_COUNTERS == channel->e2e.counter;
        result = can_take(rx, scales, frame) ? RX_ACCEPTED : RX_RANGE;
        if (!next) {
            count_up(&rx->skipped);
        }
    }
    record_result(channel, result);
    return result;
}

rx_result_t can_rx_frame(can_rx_t *rx, const bus_scales_t *scales, const can_frame_t *frame)
{
    const rx_result_t result = receive(rx, scales, frame);
    count_up(&rx->count[result]);
    return result;
}

/* Adds the time since the last step to the age; true in the step in which the message times out. */
static bool advance_age(rx_channel_t *channel, uint32_t elapsed_us, uint32_t time_out_ms)
{
    if (!channel->alive) {
        return false;
    }
    channel->age_us += elapsed_us;
    if (channel->age_us < time_out_ms * 1000U) {
        return false;
    }
    channel->alive = false;
    channel->e2e.synced = false;
    return true;
}

void can_rx_tick(can_rx_t *rx, uint32_t elapsed_us)
{
    if (advance_age(&rx->command_channel, elapsed_us, BUS_VCU_TORQUE_REQUEST_TIME_OUT_MS)) {
        rx->command = (bus_command_t){.mode = rx->command.mode};
        count_up(&rx->time_outs);
    }
    (void)advance_age(&rx->commission_channel, elapsed_us, BUS_VCU_COMMISSION_TIME_OUT_MS);
    if (advance_age(&rx->limits_channel, elapsed_us, BUS_VCU_BATTERY_LIMITS_TIME_OUT_MS)) {
        rx->limits = (bus_power_limits_t){0};
    }
}
