/* SPDX-License-Identifier: Apache-2.0 */
#include "oracle.h"

#include <string.h>

#define COMMAND_ID 0x110
#define LIMITS_ID 0x111
#define COMMAND_DATA_ID 0x1101
#define LIMITS_DATA_ID 0x1111
#define GENERATOR 0x11D

/* The remainder of the 72-bit message times x^8, one bit of the quotient after the other. */
static int remainder_of(const uint8_t message[10], int bytes)
{
    int rest = 0;
    for (int bit = 0; bit < 8 * (bytes + 1); bit++) {
        const int next = (bit < 8 * bytes) ? message[bit / 8] >> (7 - bit % 8) & 1 : 0;
        rest = rest << 1 | next;
        if (rest & 0x100) {
            rest ^= GENERATOR;
        }
    }
    return rest;
}

static bool crc_is_right(int data_id, const can_frame_t *frame)
{
    uint8_t message[10] = {(uint8_t)(data_id & 0xFF), (uint8_t)(data_id >> 8)};
    memcpy(message + 2, frame->data + 1, 7);
    return remainder_of(message, 9) == frame->data[0];
}

static int u16(const can_frame_t *frame, int at)
{
    return frame->data[at] | frame->data[at + 1] << 8;
}

static int s16(const can_frame_t *frame, int at)
{
    const int raw = u16(frame, at);
    return (raw >= 0x8000) ? raw - 0x10000 : raw;
}

void oracle_start(oracle_t *oracle)
{
    *oracle = (oracle_t){.command.last_counter = -1, .limits.last_counter = -1};
}

static void remember(oracle_channel_t *channel, bool good)
{
    memmove(channel->history + 1, channel->history, sizeof channel->history - 1);
    channel->history[0] = good ? 'g' : 'b';
}

bool oracle_failed(const oracle_channel_t *channel)
{
    int bad = 0;
    for (unsigned n = 0; n < sizeof channel->history; n++) {
        bad += channel->history[n] == 'b';
    }
    return bad >= 3;
}

/* 1: in sequence, 0: only synchronised, -1: wrong. */
static int sequence(oracle_channel_t *channel, int data_id, const can_frame_t *frame)
{
    if (frame->length != 8 || !crc_is_right(data_id, frame)) {
        return -1;
    }
    const int counter = frame->data[1] % 16;
    const int last = channel->last_counter;
    if (counter == 15) {
        return -1;
    }
    channel->last_counter = counter;
    if (last < 0) {
        return 0;
    }
    return (counter == (last + 1) % 15 || counter == (last + 2) % 15) ? 1 : -1;
}

static bool command_in_range(const can_frame_t *frame)
{
    return frame->data[1] >> 6 <= 2 && s16(frame, 2) >= -10000 && s16(frame, 2) <= 10000 && u16(frame, 4) <= 10000 &&
           u16(frame, 6) <= 10000;
}

static bool limits_in_range(const can_frame_t *frame)
{
    return u16(frame, 2) <= 60000 && u16(frame, 4) <= 60000 && u16(frame, 6) <= 15000;
}

bool oracle_frame(oracle_t *oracle, const can_frame_t *frame)
{
    const bool is_command = frame->id == COMMAND_ID;
    if (frame->extended || (!is_command && frame->id != LIMITS_ID)) {
        return false;
    }
    oracle_channel_t *channel = is_command ? &oracle->command : &oracle->limits;
    const int verdict = sequence(channel, is_command ? COMMAND_DATA_ID : LIMITS_DATA_ID, frame);
    if (verdict == 0) {
        return false;
    }
    const bool good = verdict == 1 && (is_command ? command_in_range(frame) : limits_in_range(frame));
    remember(channel, good);
    if (!good) {
        return false;
    }
    channel->alive = true;
    channel->accepted_ms = oracle->now_ms;
    if (is_command) {
        oracle->enable = (frame->data[1] & 0x10) != 0;
        oracle->reset = (frame->data[1] & 0x20) != 0;
        oracle->mode = frame->data[1] >> 6;
        oracle->torque_dNm = s16(frame, 2);
        oracle->drive_dNm = u16(frame, 4);
        oracle->regen_dNm = u16(frame, 6);
        oracle->accepted++;
    } else {
        oracle->power_drive_10W = u16(frame, 2);
        oracle->power_regen_10W = u16(frame, 4);
        oracle->battery_dV = u16(frame, 6);
    }
    return true;
}

static bool dies(oracle_t *oracle, oracle_channel_t *channel, uint32_t time_out_ms)
{
    if (!channel->alive || oracle->now_ms - channel->accepted_ms < time_out_ms) {
        return false;
    }
    channel->alive = false;
    channel->last_counter = -1;
    return true;
}

void oracle_tick(oracle_t *oracle)
{
    oracle->now_ms++;
    if (dies(oracle, &oracle->command, 30)) {
        oracle->enable = oracle->reset = false;
        oracle->torque_dNm = oracle->drive_dNm = oracle->regen_dNm = 0;
    }
    if (dies(oracle, &oracle->limits, 300)) {
        oracle->power_drive_10W = oracle->power_regen_10W = 0;
    }
}
