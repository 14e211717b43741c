/* SPDX-License-Identifier: Apache-2.0 */
#include "comm/can_rx.h"
#include "signal/step_clock.h"
#include "unity.h"

/* Copied by hand from firmware/comm/fluxtrue.dbc. */
#define COMMAND_ID 0x110U
#define COMMAND_DATA_ID 0x1101U
#define LIMITS_ID 0x111U
#define LIMITS_DATA_ID 0x1111U
#define COMMISSION_ID 0x112U
#define COMMISSION_DATA_ID 0x1121U

static bus_scales_t scales;
static can_rx_t rx;
static uint8_t counter;

void setUp(void)
{
    scales = (bus_scales_t){.torque_Nm = 0.1F, .voltage_V = 0.1F, .power_kW = 0.01F};
    rx = (can_rx_t){0};
    counter = 0;
}

void tearDown(void)
{
}

/* Enabled, torque mode, request in 0.1 N·m, limits 100.0 and 50.0 N·m. */
static can_frame_t command(int tenths_Nm)
{
    const unsigned raw = (unsigned)tenths_Nm & 0xFFFFU;
    can_frame_t frame = {.id = COMMAND_ID,
                         .length = 8,
                         .data = {0, 0x50, (uint8_t)(raw & 0xFFU), (uint8_t)(raw >> 8), 0xE8, 0x03, 0xF4, 0x01}};
    e2e_protect(COMMAND_DATA_ID, &counter, &frame);
    return frame;
}

static rx_result_t send(int tenths_Nm)
{
    const can_frame_t frame = command(tenths_Nm);
    return can_rx_frame(&rx, &scales, &frame);
}

static void milliseconds(int count)
{
    for (int n = 0; n < count; n++) {
        can_rx_tick(&rx, 1000);
    }
}

void test_a_valid_command_is_decoded_to_physical_units(void)
{
    TEST_ASSERT_EQUAL_INT(RX_SYNCED, send(400));
    TEST_ASSERT_FALSE(rx.command_channel.alive);
    TEST_ASSERT_EQUAL_FLOAT(0.0F, rx.command.torque_requested_Nm);
    TEST_ASSERT_EQUAL_INT(RX_ACCEPTED, send(-425));
    TEST_ASSERT_TRUE(rx.command_channel.alive);
    TEST_ASSERT_TRUE(rx.command.enable);
    TEST_ASSERT_FALSE(rx.command.fault_reset);
    TEST_ASSERT_EQUAL_INT(COMMAND_MODE_TORQUE, rx.command.mode);
    TEST_ASSERT_EQUAL_FLOAT(-42.5F, rx.command.torque_requested_Nm);
    TEST_ASSERT_EQUAL_FLOAT(100.0F, rx.command.limit_drive_Nm);
    TEST_ASSERT_EQUAL_FLOAT(50.0F, rx.command.limit_regen_Nm);
    TEST_ASSERT_EQUAL_UINT16(1, rx.accepted);
}

void test_commands_and_limits_are_decoded_in_the_scale_of_the_motor(void)
{
    scales = (bus_scales_t){.torque_Nm = 0.0005F, .power_kW = 0.02F};
    (void)send(400);
    TEST_ASSERT_EQUAL_INT(RX_ACCEPTED, send(-425));
    TEST_ASSERT_EQUAL_FLOAT(-0.2125F, rx.command.torque_requested_Nm);
    TEST_ASSERT_EQUAL_FLOAT(0.5F, rx.command.limit_drive_Nm);
    TEST_ASSERT_EQUAL_FLOAT(0.25F, rx.command.limit_regen_Nm);
    uint8_t next = 0;
    for (int n = 0; n < 2; n++) {
        can_frame_t limits = {.id = LIMITS_ID, .length = 8, .data = {0, 0, 0x10, 0x27, 0x20, 0x4E}};
        e2e_protect(LIMITS_DATA_ID, &next, &limits);
        (void)can_rx_frame(&rx, &scales, &limits);
    }
    TEST_ASSERT_EQUAL_FLOAT(200.0F, rx.limits.drive_kW);
    TEST_ASSERT_EQUAL_FLOAT(400.0F, rx.limits.regen_kW);
}

static void refused(rx_result_t why, const can_frame_t *frame)
{
    const bus_command_t before = rx.command;
    const uint16_t counted = rx.count[why];
    TEST_ASSERT_EQUAL_INT(why, can_rx_frame(&rx, &scales, frame));
    TEST_ASSERT_EQUAL_UINT16(counted + 1, rx.count[why]);
    TEST_ASSERT_EQUAL_MEMORY(&before, &rx.command, sizeof before);
}

void test_each_kind_of_violation_has_its_counter_and_changes_no_command(void)
{
    (void)send(0);
    (void)send(100);
    can_frame_t frame = command(200);
    frame.data[0] ^= 0x01U;
    refused(RX_CRC, &frame);
    counter = (uint8_t)(counter + 14U) % 15U; /* the receiver did not count the bad frame */
    frame = command(200);
    TEST_ASSERT_EQUAL_INT(RX_ACCEPTED, can_rx_frame(&rx, &scales, &frame));
    refused(RX_REPEATED, &frame);
    counter = (uint8_t)(counter + 3U) % 15U;
    frame = command(300);
    refused(RX_JUMP, &frame);
    frame = command(400);
    frame.length = 7;
    refused(RX_LENGTH, &frame);
    counter = (uint8_t)(counter + 14U) % 15U;
    frame = command(10001); /* 1000.1 N·m: beyond the range of the DBC, with a good CRC */
    refused(RX_RANGE, &frame);
    frame = command(100);
    frame.extended = true;
    refused(RX_ID, &frame);
    frame.extended = false;
    frame.data[0] = e2e_crc(LIMITS_DATA_ID, &frame); /* the data id of another message */
    refused(RX_ID, &frame);
    frame.id = 0x113;
    refused(RX_IGNORED, &frame);
}

/* Also those that the inverter itself sends: a gateway may have sent one of them with another identifier. */
void test_the_data_id_of_any_other_protected_message_shows_a_wrong_identifier(void)
{
    static const uint16_t others[] = {0x2101U, 0x2151U, 0x1111U};
    (void)send(0);
    for (unsigned n = 0; n < sizeof others / sizeof others[0]; n++) {
        can_frame_t frame = command(0);
        frame.data[0] = e2e_crc(others[n], &frame);
        refused(RX_ID, &frame);
    }
}

/* 1000.0 N·m are 10000 counts. Both ends of the requested torque, and the upper ends of mode and limit. */
void test_the_ends_of_the_ranges_are_accepted_and_one_count_beyond_is_not(void)
{
    (void)send(0);
    TEST_ASSERT_EQUAL_INT(RX_ACCEPTED, send(10000));
    TEST_ASSERT_EQUAL_INT(RX_ACCEPTED, send(-10000));
    TEST_ASSERT_EQUAL_INT(RX_RANGE, send(-10001));
    TEST_ASSERT_EQUAL_INT(RX_RANGE, send(32767));
    TEST_ASSERT_EQUAL_INT(RX_ACCEPTED, send(1));
    can_frame_t frame = command(1);
    frame.data[1] |= 0xC0U; /* mode 3 */
    frame.data[0] = e2e_crc(COMMAND_DATA_ID, &frame);
    TEST_ASSERT_EQUAL_INT(RX_RANGE, can_rx_frame(&rx, &scales, &frame));
    frame = command(1);
    frame.data[5] = 0x28; /* limit 0x28E8 = 1047.2 N·m */
    frame.data[0] = e2e_crc(COMMAND_DATA_ID, &frame);
    TEST_ASSERT_EQUAL_INT(RX_RANGE, can_rx_frame(&rx, &scales, &frame));
}

void test_one_lost_frame_is_tolerated_and_counted_two_are_a_jump(void)
{
    (void)send(0);
    (void)command(0);
    TEST_ASSERT_EQUAL_INT(RX_ACCEPTED, send(10));
    TEST_ASSERT_EQUAL_UINT16(1, rx.skipped);
    (void)command(0);
    (void)command(0);
    TEST_ASSERT_EQUAL_INT(RX_JUMP, send(20));
    TEST_ASSERT_EQUAL_INT(RX_ACCEPTED, send(20));
}

void test_of_frames_in_a_row_none_counts_as_skipped_and_a_lost_one_at_any_count_does(void)
{
    (void)send(0);
    for (int n = 0; n < 30; n++) {
        TEST_ASSERT_EQUAL_INT(RX_ACCEPTED, send(0));
    }
    TEST_ASSERT_EQUAL_UINT16(0, rx.skipped);
    for (uint16_t n = 1; n <= 15; n++) {
        (void)command(0);
        TEST_ASSERT_EQUAL_INT(RX_ACCEPTED, send(0));
        TEST_ASSERT_EQUAL_UINT16(n, rx.skipped);
    }
}

/* 30 ms after the last good frame, and not a millisecond earlier, torque and enable are cleared; the mode stays. */
void test_a_command_times_out_after_30_ms_and_clears_torque_and_enable(void)
{
    (void)send(0);
    (void)send(500);
    milliseconds(29);
    TEST_ASSERT_TRUE(rx.command_channel.alive);
    TEST_ASSERT_EQUAL_FLOAT(50.0F, rx.command.torque_requested_Nm);
    milliseconds(1);
    TEST_ASSERT_FALSE(rx.command_channel.alive);
    TEST_ASSERT_EQUAL_FLOAT(0.0F, rx.command.torque_requested_Nm);
    TEST_ASSERT_FALSE(rx.command.enable);
    TEST_ASSERT_EQUAL_INT(COMMAND_MODE_TORQUE, rx.command.mode);
    milliseconds(1000);
    TEST_ASSERT_EQUAL_UINT16(1, rx.time_outs);
    TEST_ASSERT_EQUAL_INT(RX_SYNCED, send(500)); /* the next frame synchronises again */
    TEST_ASSERT_EQUAL_INT(RX_ACCEPTED, send(500));
}

void test_the_age_of_a_command_begins_with_its_frame(void)
{
    (void)send(0);
    (void)send(0);
    can_rx_tick(&rx, 29999);
    TEST_ASSERT_TRUE(rx.command_channel.alive);
    can_rx_tick(&rx, 1);
    TEST_ASSERT_FALSE(rx.command_channel.alive);
}

/* 22 periods at 22.5 kHz are a step of 977.8 us: 30 steps are 29.33 ms, 31 are 30.31 ms. The time-out is never early
 * and less than a step late. */
void test_a_time_out_ends_in_the_first_step_in_which_its_time_has_passed(void)
{
    static const uint32_t step_ns[] = {888889U, 977778U, 1000000U, 1111111U, 1125000U};
    for (unsigned k = 0; k < sizeof step_ns / sizeof step_ns[0]; k++) {
        setUp();
        step_clock_t clock;
        step_clock_start(&clock, step_ns[k]);
        (void)send(0);
        (void)send(100);
        uint64_t passed_ns = 0;
        while (rx.command_channel.alive) {
            step_clock_step(&clock);
            can_rx_tick(&rx, clock.elapsed_us);
            passed_ns += step_ns[k];
        }
        TEST_ASSERT_TRUE(passed_ns + 1000U >= 30000000U && passed_ns < 30000000U + step_ns[k]);
    }
}

/* Bad frames do not keep a command alive. */
void test_frames_with_a_wrong_crc_do_not_delay_the_time_out(void)
{
    (void)send(0);
    (void)send(500);
    for (int n = 0; n < 30; n++) {
        can_frame_t frame = command(500);
        frame.data[0] ^= 0xFFU;
        (void)can_rx_frame(&rx, &scales, &frame);
        can_rx_tick(&rx, 1000);
    }
    TEST_ASSERT_FALSE(rx.command_channel.alive);
}

void test_three_bad_frames_of_the_last_ten_fail_the_channel_until_they_have_passed(void)
{
    (void)send(0);
    can_frame_t bad = command(0);
    bad.data[0] ^= 0xFFU;
    counter = (uint8_t)(counter + 14U) % 15U;
    for (int pattern = 0; pattern < 1024; pattern++) {
        rx.command_channel.bad = 0;
        int count = 0;
        for (int n = 0; n < 10; n++) {
            const bool is_bad = (pattern >> n & 1) != 0;
            count += is_bad ? 1 : 0;
            (void)(is_bad ? can_rx_frame(&rx, &scales, &bad) : send(0));
        }
        TEST_ASSERT_EQUAL(count >= 3, rx.command_channel.failed);
    }
    for (int n = 0; n < 8; n++) {
        (void)send(0);
    }
    TEST_ASSERT_FALSE(rx.command_channel.failed);
}

/* The first frame after each time-out only synchronises: it is neither good nor bad. */
void test_frames_that_synchronise_do_not_fail_the_channel(void)
{
    for (int n = 0; n < 5; n++) {
        TEST_ASSERT_EQUAL_INT(RX_SYNCED, send(0));
        TEST_ASSERT_EQUAL_INT(RX_ACCEPTED, send(0));
        TEST_ASSERT_FALSE(rx.command_channel.failed);
        milliseconds(30);
    }
}

static rx_result_t send_limits(uint8_t *count, unsigned drive, unsigned regen)
{
    can_frame_t frame = {.id = LIMITS_ID,
                         .length = 8,
                         .data = {0, 0, (uint8_t)(drive & 0xFFU), (uint8_t)(drive >> 8), (uint8_t)(regen & 0xFFU),
                                  (uint8_t)(regen >> 8), 0xA7, 0x0D}};
    e2e_protect(LIMITS_DATA_ID, count, &frame);
    return can_rx_frame(&rx, &scales, &frame);
}

/* Movement 2, reversed, damped; -400 and 123 of 11 bits from bit 16; 5 pole pairs from bit 38; direction 1 from bit 44;
 * a consent to pulses in bit 46; offset 0xBEEF. */
static can_frame_t commission_frame(uint8_t *count, int current_d)
{
    const uint64_t raw = (uint64_t)2 << 12 | (uint64_t)1 << 14 | (uint64_t)1 << 15 |
                         (uint64_t)((unsigned)current_d & 0x7FFU) << 16 | (uint64_t)123 << 27 | (uint64_t)5 << 38 |
                         (uint64_t)1 << 44 | (uint64_t)1 << 46 | (uint64_t)0xBEEF << 48;
    can_frame_t frame = {.id = COMMISSION_ID, .length = 8};
    for (unsigned n = 0; n < 8; n++) {
        frame.data[n] = (uint8_t)(raw >> (8U * n));
    }
    e2e_protect(COMMISSION_DATA_ID, count, &frame);
    return frame;
}

void test_a_movement_has_its_own_channel_and_is_not_alive_when_lost(void)
{
    uint8_t count = 0;
    can_frame_t frame = commission_frame(&count, -400);
    TEST_ASSERT_EQUAL_INT(RX_SYNCED, can_rx_frame(&rx, &scales, &frame));
    TEST_ASSERT_EQUAL_UINT8(0, rx.commission.movement);
    TEST_ASSERT_FALSE(rx.commission.pulses);
    frame = commission_frame(&count, -400);
    TEST_ASSERT_EQUAL_INT(RX_ACCEPTED, can_rx_frame(&rx, &scales, &frame));
    TEST_ASSERT_TRUE(rx.commission_channel.alive);
    TEST_ASSERT_EQUAL_UINT8(2, rx.commission.movement);
    TEST_ASSERT_TRUE(rx.commission.reversed);
    TEST_ASSERT_TRUE(rx.commission.damped);
    TEST_ASSERT_TRUE(rx.commission.pulses);
    TEST_ASSERT_EQUAL_INT16(-400, rx.commission.current_d_permille);
    TEST_ASSERT_EQUAL_INT16(123, rx.commission.current_q_permille);
    TEST_ASSERT_EQUAL_UINT8(5, rx.commission.pole_pairs);
    TEST_ASSERT_EQUAL_UINT8(1, rx.commission.direction);
    TEST_ASSERT_EQUAL_HEX16(0xBEEF, rx.commission.offset);
    frame = commission_frame(&count, -401);
    TEST_ASSERT_EQUAL_INT(RX_RANGE, can_rx_frame(&rx, &scales, &frame));
    TEST_ASSERT_EQUAL_INT16(-400, rx.commission.current_d_permille);
    milliseconds(29);
    TEST_ASSERT_TRUE(rx.commission_channel.alive);
    milliseconds(1);
    TEST_ASSERT_FALSE(rx.commission_channel.alive);
    TEST_ASSERT_FALSE(rx.command_channel.alive);
    TEST_ASSERT_EQUAL_UINT16(0, rx.time_outs); /* of torque commands */
}

/* 45.00 kW are 4500 counts, 600.01 kW are 60001; all frames have 349.5 V, 0x0DA7; the time-out is 300 ms. */
void test_battery_limits_have_their_own_channel_and_become_zero_when_lost(void)
{
    uint8_t count = 0;
    TEST_ASSERT_FALSE(rx.limits_channel.seen);
    TEST_ASSERT_EQUAL_INT(RX_SYNCED, send_limits(&count, 4500, 2000));
    TEST_ASSERT_EQUAL_FLOAT(0.0F, rx.battery_V);
    TEST_ASSERT_EQUAL_INT(RX_ACCEPTED, send_limits(&count, 4500, 2000));
    TEST_ASSERT_EQUAL_FLOAT(45.0F, rx.limits.drive_kW);
    TEST_ASSERT_EQUAL_FLOAT(20.0F, rx.limits.regen_kW);
    TEST_ASSERT_EQUAL_INT(RX_RANGE, send_limits(&count, 60001, 2000));
    milliseconds(299);
    TEST_ASSERT_TRUE(rx.limits_channel.alive);
    milliseconds(1);
    TEST_ASSERT_FALSE(rx.limits_channel.alive);
    TEST_ASSERT_TRUE(rx.limits_channel.seen);
    TEST_ASSERT_EQUAL_FLOAT(0.0F, rx.limits.drive_kW);
    TEST_ASSERT_EQUAL_FLOAT(0.0F, rx.limits.regen_kW);
    TEST_ASSERT_EQUAL_FLOAT(349.5F, rx.battery_V); /* its age says that it is an old one */
    TEST_ASSERT_FALSE(rx.command_channel.alive);
}

void test_counters_saturate(void)
{
    rx.count[RX_IGNORED] = UINT16_MAX - 1U;
    const can_frame_t frame = {.id = 0x7FF};
    for (int n = 0; n < 3; n++) {
        (void)can_rx_frame(&rx, &scales, &frame);
    }
    TEST_ASSERT_EQUAL_UINT16(UINT16_MAX, rx.count[RX_IGNORED]);
}
