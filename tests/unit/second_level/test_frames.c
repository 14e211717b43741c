/* SPDX-License-Identifier: Apache-2.0 */
/* The reception of the second level against the end-to-end protection of the first level, which makes the frames. */
#include "comm/can_rx.h"
#include "comm/e2e.h"
#include "second_level/frames.h"
#include "unity.h"

#define COMMAND_ID 0x110U
#define BATTERY_ID 0x111U
#define ENABLED_TORQUE 0x50U

static second_level_frames_t frames;
static uint8_t counter;

void setUp(void)
{
    frames = (second_level_frames_t){0};
    counter = 0;
}

void tearDown(void)
{
}

static void put16(can_frame_t *frame, unsigned at, int value)
{
    frame->data[at] = (uint8_t)((unsigned)value & 0xFFU);
    frame->data[at + 1U] = (uint8_t)((unsigned)value >> 8 & 0xFFU);
}

static can_frame_t signed_frame(uint32_t id, uint8_t bits, int a, int b, int c)
{
    can_frame_t frame = {.id = id, .length = 8};
    frame.data[1] = bits;
    put16(&frame, 2, a);
    put16(&frame, 4, b);
    put16(&frame, 6, c);
    e2e_protect((id == COMMAND_ID) ? 0x1101U : 0x1111U, &counter, &frame);
    return frame;
}

static void receive(can_frame_t frame)
{
    second_level_frame(&frames, &frame);
}

/* The first frame only synchronises the counter. */
static void synchronise(uint32_t id)
{
    receive(signed_frame(id, ENABLED_TORQUE, 0, 0, 0));
}

static void command(int torque_counts)
{
    receive(signed_frame(COMMAND_ID, ENABLED_TORQUE, torque_counts, 2000, 1500));
}

void test_a_command_is_decoded_as_the_description_of_the_bus_says(void)
{
    synchronise(COMMAND_ID);
    TEST_ASSERT_FALSE(frames.command.alive);
    command(-321);
    TEST_ASSERT_TRUE(frames.command.alive && frames.command.seen);
    TEST_ASSERT_EQUAL_INT32(-321, frames.torque_counts);
    TEST_ASSERT_EQUAL_INT32(2000, frames.drive_counts);
    TEST_ASSERT_EQUAL_INT32(1500, frames.regen_counts);
}

void test_the_limits_of_the_battery_are_decoded(void)
{
    synchronise(BATTERY_ID);
    receive(signed_frame(BATTERY_ID, 0, 60000, 59999, 0));
    TEST_ASSERT_TRUE(frames.battery.seen);
    TEST_ASSERT_EQUAL_INT32(60000, frames.power_drive_counts);
    TEST_ASSERT_EQUAL_INT32(59999, frames.power_regen_counts);
    receive(signed_frame(BATTERY_ID, 0, 100, 200, 15000)); /* 1500 V */
    TEST_ASSERT_EQUAL_INT32(100, frames.power_drive_counts);
    receive(signed_frame(BATTERY_ID, 0, 300, 400, 15001));
    TEST_ASSERT_EQUAL_INT32(100, frames.power_drive_counts);
}

/* The two levels compute the checksum by different algorithms: a frame of the first level is accepted, and refused when
 * one of its bits has changed. */
void test_the_checksum_is_that_of_the_protection_for_every_byte(void)
{
    synchronise(COMMAND_ID);
    for (int n = 0; n < 2000; n++) {
        command((n * 7919) % 10001);
        TEST_ASSERT_EQUAL_INT32((n * 7919) % 10001, frames.torque_counts);
        can_frame_t wrong = signed_frame(COMMAND_ID, ENABLED_TORQUE, 1, 2000, 1500);
        wrong.data[n % 8] ^= (uint8_t)(1U << (n / 8 % 8));
        receive(wrong);
        TEST_ASSERT_EQUAL_INT32((n * 7919) % 10001, frames.torque_counts);
    }
}

void test_without_enable_or_in_another_mode_no_torque_is_requested(void)
{
    synchronise(COMMAND_ID);
    receive(signed_frame(COMMAND_ID, 0x40, 500, 2000, 2000));
    TEST_ASSERT_EQUAL_INT32(0, frames.torque_counts);
    command(500);
    TEST_ASSERT_EQUAL_INT32(500, frames.torque_counts);
    receive(signed_frame(COMMAND_ID, 0x90, 500, 2000, 2000)); /* current mode */
    TEST_ASSERT_EQUAL_INT32(0, frames.torque_counts);
}

void test_a_value_out_of_range_refuses_the_frame(void)
{
    static const struct {
        uint8_t bits;
        int torque, drive, regen;
    } bad[] = {{ENABLED_TORQUE, 10001, 0, 0},
               {ENABLED_TORQUE, -10001, 0, 0},
               {ENABLED_TORQUE, 0, 10001, 0},
               {ENABLED_TORQUE, 0, 0, 10001},
               {0xD0, 0, 0, 0}};
    synchronise(COMMAND_ID);
    command(500);
    for (unsigned n = 0; n < sizeof bad / sizeof bad[0]; n++) {
        receive(signed_frame(COMMAND_ID, bad[n].bits, bad[n].torque, bad[n].drive, bad[n].regen));
        TEST_ASSERT_EQUAL_INT32(500, frames.torque_counts);
    }
    counter = 0;
    synchronise(BATTERY_ID);
    receive(signed_frame(BATTERY_ID, 0, 60001, 0, 0));
    receive(signed_frame(BATTERY_ID, 0, 0, 60001, 0));
    TEST_ASSERT_FALSE(frames.battery.seen);
}

void test_other_frames_change_nothing(void)
{
    synchronise(COMMAND_ID);
    command(500);
    const second_level_frames_t before = frames;
    can_frame_t other = signed_frame(COMMAND_ID, ENABLED_TORQUE, 1, 2000, 2000);
    other.id = 0x112;
    receive(other);
    other.id = COMMAND_ID;
    other.extended = true;
    receive(other);
    other.extended = false;
    other.length = 7;
    receive(other);
    other = signed_frame(COMMAND_ID, ENABLED_TORQUE, 1, 2000, 2000);
    other.id = BATTERY_ID; /* the checksum of another message */
    receive(other);
    TEST_ASSERT_EQUAL_MEMORY(&before, &frames, sizeof before);
}

void test_a_repetition_and_a_jump_are_refused_and_one_lost_frame_is_not(void)
{
    synchronise(COMMAND_ID);
    command(500);
    counter = 1;
    command(600); /* repeated */
    TEST_ASSERT_EQUAL_INT32(500, frames.torque_counts);
    counter = 3;
    command(700); /* one lost */
    TEST_ASSERT_EQUAL_INT32(700, frames.torque_counts);
    counter = 6;
    command(800); /* two lost */
    TEST_ASSERT_EQUAL_INT32(700, frames.torque_counts);
    command(900); /* follows the new counter */
    TEST_ASSERT_EQUAL_INT32(900, frames.torque_counts);
    can_frame_t invalid = {.id = COMMAND_ID, .length = 8, .data = {0, ENABLED_TORQUE | 0x0FU}};
    invalid.data[0] = e2e_crc(0x1101U, &invalid);
    receive(invalid);
    TEST_ASSERT_EQUAL_INT32(900, frames.torque_counts);
}

void test_a_command_that_stops_requests_no_torque_after_35_ms_and_must_synchronise_again(void)
{
    synchronise(COMMAND_ID);
    command(500);
    for (int n = 0; n < 34; n++) {
        second_level_frames_tick(&frames, 1000);
    }
    TEST_ASSERT_EQUAL_INT32(500, frames.torque_counts);
    second_level_frames_tick(&frames, 1000);
    TEST_ASSERT_EQUAL_INT32(0, frames.torque_counts);
    command(500);
    TEST_ASSERT_EQUAL_INT32(0, frames.torque_counts);
    command(500);
    TEST_ASSERT_EQUAL_INT32(500, frames.torque_counts);
}

void test_limits_that_stop_are_zero_after_310_ms(void)
{
    synchronise(BATTERY_ID);
    receive(signed_frame(BATTERY_ID, 0, 100, 200, 0));
    for (int n = 0; n < 309; n++) {
        second_level_frames_tick(&frames, 1000);
    }
    TEST_ASSERT_EQUAL_INT32(200, frames.power_regen_counts);
    second_level_frames_tick(&frames, 1000);
    TEST_ASSERT_EQUAL_INT32(0, frames.power_drive_counts + frames.power_regen_counts);
    TEST_ASSERT_TRUE(frames.battery.seen && !frames.battery.alive);
}

/* 10,000 counts of the torque and of its limits, 60,000 of both powers. */
void test_the_ends_of_the_ranges_are_accepted(void)
{
    synchronise(COMMAND_ID);
    for (int sign = -1; sign <= 1; sign += 2) {
        receive(signed_frame(COMMAND_ID, ENABLED_TORQUE, sign * 10000, 10000, 10000));
        TEST_ASSERT_EQUAL_INT32(sign * 10000, frames.torque_counts);
    }
    TEST_ASSERT_EQUAL_INT32(10000, frames.drive_counts);
    TEST_ASSERT_EQUAL_INT32(10000, frames.regen_counts);
    counter = 0;
    synchronise(BATTERY_ID);
    receive(signed_frame(BATTERY_ID, 0, 60000, 60000, 0));
    TEST_ASSERT_EQUAL_INT32(60000, frames.power_drive_counts);
    TEST_ASSERT_EQUAL_INT32(60000, frames.power_regen_counts);
}

/* The counter has 15 values: after 14 a 15 would be ahead by 1, after 13 by 2. */
void test_a_counter_of_15_never_follows(void)
{
    can_frame_t invalid = signed_frame(COMMAND_ID, ENABLED_TORQUE | 0x0FU, 900, 2000, 1500);
    invalid.data[1] |= 0x0FU;
    invalid.data[0] = e2e_crc(0x1101U, &invalid);
    for (uint8_t last = 13; last <= 14; last++) {
        frames.command = (second_level_channel_t){.counter = last, .synced = true};
        receive(invalid);
        TEST_ASSERT_EQUAL_INT32(0, frames.torque_counts);
        TEST_ASSERT_FALSE(frames.command.alive);
        TEST_ASSERT_EQUAL_UINT8(last, frames.command.counter);
    }
}

void test_each_message_has_a_counter_of_its_own(void)
{
    counter = 3;
    synchronise(COMMAND_ID);
    command(500);
    counter = 9;
    synchronise(BATTERY_ID);
    receive(signed_frame(BATTERY_ID, 0, 100, 200, 0));
    TEST_ASSERT_EQUAL_INT32(100, frames.power_drive_counts);
    counter = 5;
    command(600);
    TEST_ASSERT_EQUAL_INT32(600, frames.torque_counts);
    counter = 11;
    receive(signed_frame(BATTERY_ID, 0, 300, 400, 0));
    TEST_ASSERT_EQUAL_INT32(300, frames.power_drive_counts);
}

void test_another_identifier_with_a_checksum_of_the_battery_s_limits_is_no_message(void)
{
    synchronise(BATTERY_ID);
    can_frame_t other = signed_frame(BATTERY_ID, 0, 100, 200, 0);
    other.id = 0x112;
    receive(other);
    TEST_ASSERT_FALSE(frames.battery.alive);
    TEST_ASSERT_EQUAL_INT32(0, frames.power_drive_counts);
}

/* To the microsecond, also after frames that came in time. */
void test_the_time_out_begins_with_the_last_frame(void)
{
    synchronise(COMMAND_ID);
    for (int n = 0; n < 3; n++) {
        command(500);
        second_level_frames_tick(&frames, 34999);
        TEST_ASSERT_EQUAL_INT32(500, frames.torque_counts);
    }
    second_level_frames_tick(&frames, 1);
    TEST_ASSERT_EQUAL_INT32(0, frames.torque_counts);
}

/* The age is that of a command, and the first frame is none. */
void test_the_second_frame_may_come_later_than_the_time_out(void)
{
    synchronise(COMMAND_ID);
    second_level_frames_tick(&frames, 40000);
    command(500);
    TEST_ASSERT_EQUAL_INT32(500, frames.torque_counts);
}
