/* SPDX-License-Identifier: Apache-2.0 */
/* Formats and conversions of the port: CAN message buffers, resolver frames, temperature sensors. */
#include <math.h>
#include <string.h>

#include "hal/s32k144/ad2s1210.h"
#include "hal/s32k144/can_mailbox.h"
#include "hal/s32k144/die.h"
#include "hal/s32k144/ntc.h"
#include "hal/s32k144/retained.h"
#include "hal/temperature.h"
#include "unity.h"

void setUp(void)
{
}
void tearDown(void)
{
}

/* The words by hand: identifier 0x123 << 18 = 0x048C0000, length 8, code 12. */
void test_a_standard_frame_fills_the_buffer_from_the_top_byte_down(void)
{
    const can_frame_t frame = {.id = 0x123, .length = 8, .data = {1, 2, 3, 4, 5, 6, 7, 8}};
    const can_box_t box = can_box_pack(&frame);
    const uint32_t expected[4] = {0x0C080000, 0x048C0000, 0x01020304, 0x05060708};
    TEST_ASSERT_EQUAL_HEX32_ARRAY(expected, box.word, 4);
}

void test_an_extended_frame_is_marked_as_extended(void)
{
    const can_frame_t frame = {.id = 0x1ABCDEF0, .extended = true, .length = 0};
    const can_box_t box = can_box_pack(&frame);
    TEST_ASSERT_EQUAL_HEX32(0x0C600000, box.word[0]);
    TEST_ASSERT_EQUAL_HEX32(0x1ABCDEF0, box.word[1]);
}

void test_what_was_packed_unpacks_to_the_same_frame(void)
{
    for (uint8_t length = 0; length <= 8; length++) {
        can_frame_t frame = {.id = (length & 1U) ? 0x7FFU : 0x1FFFFFFFU, .extended = !(length & 1U), .length = length};
        for (uint8_t k = 0; k < length; k++) {
            frame.data[k] = (uint8_t)(0xF0U + k);
        }
        const can_box_t box = can_box_pack(&frame);
        const can_frame_t back = can_box_unpack(&box);
        TEST_ASSERT_EQUAL_HEX32(frame.id, back.id);
        TEST_ASSERT_EQUAL(frame.extended, back.extended);
        TEST_ASSERT_EQUAL_UINT8(length, back.length);
        TEST_ASSERT_EQUAL_HEX8_ARRAY(frame.data, back.data, 8);
    }
}

void test_impossible_lengths_become_eight_and_a_remote_request_has_no_data(void)
{
    const can_box_t nine = {{15U << 16, 0, 0, 0}};
    TEST_ASSERT_EQUAL_UINT8(8, can_box_unpack(&nine).length);
    const can_box_t remote = {{CAN_BOX_REMOTE | 4U << 16, 0, 0xFFFFFFFFU, 0}};
    TEST_ASSERT_EQUAL_UINT8(0, can_box_unpack(&remote).length);
    TEST_ASSERT_EQUAL_HEX8(0, can_box_unpack(&remote).data[0]);
    const can_frame_t long_one = {.id = 0xFFFFFFFFU, .length = 200};
    TEST_ASSERT_EQUAL_HEX32(0x0C080000, can_box_pack(&long_one).word[0]);
    TEST_ASSERT_EQUAL_HEX32(0x7FFU << 18, can_box_pack(&long_one).word[1]);
}

void test_a_resolver_frame_is_the_value_and_then_the_faults(void)
{
    const ad2s1210_frame_t frame = ad2s1210_decode(0xC0DE48);
    TEST_ASSERT_EQUAL_HEX16(0xC0DE, frame.value);
    TEST_ASSERT_EQUAL_HEX8(AD2S1210_SIGNAL_LOSS | AD2S1210_TRACKING, frame.fault);
}

/* Linear interpolation over 10 K deviates from the beta equation by 0.6 K at most, the rounding by 0.05 K. Above 150 °C
 * the nodes are rounded to whole counts, and half a count is 0.6 K at 150 °C and 3.2 K at 300 °C. */
void test_the_ntc_follows_the_beta_equation_over_its_range(void)
{
    for (uint16_t count = 16; count <= 3937; count++) {
        const double r = count / (4096.0 - count);
        const double exact_dC = 10.0 * (1.0 / (1.0 / 298.15 + log(r) / 3435.0) - 273.15);
        TEST_ASSERT_DOUBLE_WITHIN(count < 132 ? 40.0 : 7.0, exact_dC, ntc_dC(count));
    }
}

void test_an_open_or_shorted_ntc_is_out_of_range(void)
{
    TEST_ASSERT_EQUAL_INT16(TEMPERATURE_OUT_OF_RANGE, ntc_dC(4095));
    TEST_ASSERT_EQUAL_INT16(TEMPERATURE_OUT_OF_RANGE, ntc_dC(3938));
    TEST_ASSERT_EQUAL_INT16(TEMPERATURE_OUT_OF_RANGE, ntc_dC(15));
    TEST_ASSERT_EQUAL_INT16(TEMPERATURE_OUT_OF_RANGE, ntc_dC(0));
}

/* motor.toml allows trip levels up to 300 °C. */
void test_the_ntc_reaches_every_temperature_at_which_a_drive_trips(void)
{
    TEST_ASSERT_EQUAL_INT16(3000, ntc_dC(16));
    TEST_ASSERT_EQUAL_INT16(2300, ntc_dC(37));
}

/* 740.5 mV at 25 °C and 1.564 mV less per kelvin, 4096 counts for 5 V: 606.6 counts at 25 °C, 0.7805 K per count. */
void test_the_sensor_on_the_die_follows_its_line_and_is_unknown_outside_the_range_of_the_processor(void)
{
    for (uint16_t count = 383; count <= 703; count++) {
        const double exact_dC = 250.0 - 10.0 * (count * 5000.0 / 4096.0 - 740.5) / 1.564;
        TEST_ASSERT_DOUBLE_WITHIN(5.0, exact_dC, die_dC(count));
    }
    TEST_ASSERT_EQUAL_INT16(250, die_dC(607));
    TEST_ASSERT_EQUAL_INT16(TEMPERATURE_UNKNOWN, die_dC(382));
    TEST_ASSERT_EQUAL_INT16(TEMPERATURE_UNKNOWN, die_dC(704));
    TEST_ASSERT_EQUAL_INT16(TEMPERATURE_UNKNOWN, die_dC(0));
    TEST_ASSERT_EQUAL_INT16(TEMPERATURE_UNKNOWN, die_dC(4095));
}

void test_what_outlasts_a_reset_is_written_in_every_fourth_step_and_at_once_when_a_flag_changes(void)
{
    const retained_t last = {.drive = {.speed = 100, .armed = true, .speed_valid = true}, .lines = 3};
    retained_t now = last;
    now.drive.speed = 200;
    int written = 0;
    for (uint32_t step = 1; step <= 40; step++) {
        written += retained_is_due(&now, &last, step) ? 1 : 0;
    }
    TEST_ASSERT_EQUAL_INT(10, written);
    TEST_ASSERT_FALSE(retained_is_due(&now, &last, 1));
    now.lines = 1;
    TEST_ASSERT_TRUE(retained_is_due(&now, &last, 1));
    now = last;
    now.drive.armed = false;
    TEST_ASSERT_TRUE(retained_is_due(&now, &last, 1));
    now = last;
    now.drive.speed_valid = false;
    TEST_ASSERT_TRUE(retained_is_due(&now, &last, 1));
}
