/* SPDX-License-Identifier: Apache-2.0 */
#include "second_level/frames.h"

#define COMMAND_ID 0x110U
#define COMMAND_DATA_ID 0x1101U
#define COMMAND_MAX 10000
#define COMMAND_TIME_OUT_US 35000U /* not before the first level's 30 ms */
#define BATTERY_ID 0x111U
#define BATTERY_DATA_ID 0x1111U
#define BATTERY_MAX 60000
#define BATTERY_VOLTAGE_MAX 15000
#define BATTERY_TIME_OUT_US 310000U
#define LENGTH 8U
#define COUNTERS 15U

#define ENABLE 0x10U
#define MODE_SHIFT 6
#define MODE_TORQUE 1U
#define MODE_MAX 2U

/* CRC of a half byte: remainders of n x^8 by x^8 + x^4 + x^3 + x^2 + 1. */
static const uint8_t remainders[16] = {0x00, 0x1D, 0x3A, 0x27, 0x74, 0x69, 0x4E, 0x53,
                                       0xE8, 0xF5, 0xD2, 0xCF, 0x9C, 0x81, 0xA6, 0xBB};

static unsigned crc_of(unsigned crc, unsigned byte)
{
    const unsigned upper = crc ^ byte;
    const unsigned half = (upper << 4 & 0xFFU) ^ remainders[upper >> 4];
    return (half << 4 & 0xFFU) ^ remainders[half >> 4];
}

static bool is_crc_right(const can_frame_t *frame, unsigned data_id)
{
    unsigned crc = crc_of(crc_of(0U, data_id & 0xFFU), data_id >> 8);
    for (unsigned n = 1; n < LENGTH; n++) {
        crc = crc_of(crc, frame->data[n]);
    }
    return crc == frame->data[0];
}

/* Whether the counter of the frame has advanced by 1 or 2 since the last frame of its channel. */
static bool follows(second_level_channel_t *channel, unsigned counter)
{
    if (counter >= COUNTERS) {
        return false;
    }
    const unsigned ahead = (counter + COUNTERS - channel->counter) % COUNTERS;
    const bool next = channel->synced && (ahead == 1U || ahead == 2U);
    channel->counter = (uint8_t)counter;
    channel->synced = true;
    return next;
}

static int32_t unsigned_at(const can_frame_t *frame, unsigned at)
{
    return (int32_t)((uint32_t)frame->data[at] | (uint32_t)frame->data[at + 1U] << 8);
}

static void refresh(second_level_channel_t *channel)
{
    channel->age_us = 0;
    channel->alive = true;
    channel->seen = true;
}

static void take_command(second_level_frames_t *frames, const can_frame_t *frame)
{
    const int32_t torque = (int16_t)unsigned_at(frame, 2);
    const int32_t drive = unsigned_at(frame, 4);
    const int32_t regen = unsigned_at(frame, 6);
    const unsigned mode = (unsigned)frame->data[1] >> MODE_SHIFT;
    if (torque < -COMMAND_MAX || torque > COMMAND_MAX || drive > COMMAND_MAX || regen > COMMAND_MAX ||
        mode > MODE_MAX) {
        return;
    }
    const bool enabled = (frame->data[1] & ENABLE) != 0U && mode == MODE_TORQUE;
    frames->torque_counts = enabled ? torque : 0;
    frames->drive_counts = drive;
    frames->regen_counts = regen;
    refresh(&frames->command);
}

static void take_battery(second_level_frames_t *frames, const can_frame_t *frame)
{
    const int32_t drive = unsigned_at(frame, 2);
    const int32_t regen = unsigned_at(frame, 4);
    if (drive > BATTERY_MAX || regen > BATTERY_MAX || unsigned_at(frame, 6) > BATTERY_VOLTAGE_MAX) {
        return;
    }
    frames->power_drive_counts = drive;
    frames->power_regen_counts = regen;
    refresh(&frames->battery);
}

void second_level_frame(second_level_frames_t *frames, const can_frame_t *frame)
{
    const bool is_command = frame->id == COMMAND_ID;
    if ((!is_command && frame->id != BATTERY_ID) || frame->extended || frame->length != LENGTH ||
        !is_crc_right(frame, is_command ? COMMAND_DATA_ID : BATTERY_DATA_ID) ||
        !follows(is_command ? &frames->command : &frames->battery, frame->data[1] & 0x0FU)) {
        return;
    }
    if (is_command) {
        take_command(frames, frame);
    } else {
        take_battery(frames, frame);
    }
}

/* True while the channel has timed out. */
static bool has_timed_out(second_level_channel_t *channel, uint32_t elapsed_us, uint32_t time_out_us)
{
    if (channel->alive) {
        channel->age_us += elapsed_us;
        if (channel->age_us >= time_out_us) {
            channel->alive = false;
            channel->synced = false;
        }
    }
    return !channel->alive;
}

void second_level_frames_tick(second_level_frames_t *frames, uint32_t elapsed_us)
{
    if (has_timed_out(&frames->command, elapsed_us, COMMAND_TIME_OUT_US)) {
        frames->torque_counts = 0;
    }
    if (has_timed_out(&frames->battery, elapsed_us, BATTERY_TIME_OUT_US)) {
        frames->power_drive_counts = 0;
        frames->power_regen_counts = 0;
    }
}
