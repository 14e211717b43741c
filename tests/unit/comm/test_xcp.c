/* SPDX-License-Identifier: Apache-2.0 */
#include <math.h>
#include <string.h>

#include "unity.h"
#include "xcp_master.h"

void setUp(void)
{
    master_reset();
}

void tearDown(void)
{
}

static void write_float(int parameter, float value)
{
    master_download(xcp_address(&working[parameter]), &value, 4);
}

static void ready(void)
{
    master_connect();
    master_unlock();
}

void test_before_connect_the_slave_is_silent(void)
{
    SEND(0xFD);
    TEST_ASSERT_FALSE(answered);
    SEND(0xF5, 1);
    TEST_ASSERT_FALSE(answered);
    TEST_ASSERT_EQUAL_UINT32(2, slave.counts.ignored);
}

void test_a_frame_without_data_or_longer_than_a_packet_is_ignored(void)
{
    can_frame_t command = {.id = 0x650, .length = 9, .data = {0xFD}};
    master_connect();
    TEST_ASSERT_FALSE(xcp_command(&slave, &slave_config, &command, &last_answer));
    command.length = 0;
    TEST_ASSERT_FALSE(xcp_command(&slave, &slave_config, &command, &last_answer));
    TEST_ASSERT_EQUAL_UINT32(2, slave.counts.ignored);
    command.length = 8;
    TEST_ASSERT_TRUE(xcp_command(&slave, &slave_config, &command, &last_answer));
}

void test_connect_reports_resources_and_packet_sizes(void)
{
    SEND(0xFF, 0);
    EXPECT(0xFF, 0x05, 0x80, 8, 8, 0, 1, 1);
    TEST_ASSERT_EQUAL_UINT8(8, last_answer.length);
}

void test_after_disconnect_the_slave_is_silent_again_and_locked(void)
{
    ready();
    SEND(0xFE);
    EXPECT(0xFF);
    SEND(0xFD);
    TEST_ASSERT_FALSE(answered);
    master_connect();
    SEND(0xFD);
    EXPECT(0xFF, 0x00, 0x01);
}

void test_an_unknown_command_and_a_short_one_have_different_errors(void)
{
    master_connect();
    SEND(0x01);
    EXPECT_ERROR(0x20);
    SEND(0xF3, 0, 0, 0);
    EXPECT_ERROR(0x21);
    SEND(0xD2, 0, 0, 0, 0, 0, 0, 0);
    EXPECT_ERROR(0x20);
}

void test_synch_answers_with_the_synch_error(void)
{
    master_connect();
    SEND(0xFC);
    EXPECT_ERROR(0x00);
    TEST_ASSERT_EQUAL_UINT32(0, slave.counts.refused);
}

void test_memory_outside_the_areas_cannot_be_read(void)
{
    master_connect();
    SEND(0xF4, 4, 0, 0, AT(&measured[12]));
    EXPECT(0xFF, 0xAC, 0xAD, 0xAE, 0xAF);
    SEND(0xF4, 4, 0, 0, AT(&measured[13]));
    EXPECT_ERROR(0x24);
    SEND(0xF4, 1, 0, 0, AT(&slave));
    EXPECT_ERROR(0x24);
    SEND(0xF4, 7, 0, 0, 0xFF, 0xFF, 0xFF, 0xFF);
    EXPECT_ERROR(0x24);
}

void test_upload_goes_on_where_it_stopped(void)
{
    master_connect();
    SEND(0xF6, 0, 0, 0, AT(measured));
    SEND(0xF5, 7);
    EXPECT(0xFF, 0xA0, 0xA1, 0xA2, 0xA3, 0xA4, 0xA5, 0xA6);
    SEND(0xF5, 2);
    EXPECT(0xFF, 0xA7, 0xA8);
    TEST_ASSERT_EQUAL_UINT8(3, last_answer.length);
    SEND(0xF5, 8);
    EXPECT_ERROR(0x22);
    SEND(0xF5, 0);
    EXPECT_ERROR(0x22);
}

void test_a_write_needs_the_key(void)
{
    master_connect();
    write_float(0, 5.0F);
    EXPECT_ERROR(0x25);
    TEST_ASSERT_EQUAL_FLOAT(1.0F, working[0]);
    master_unlock();
    write_float(0, 5.0F);
    EXPECT(0xFF);
    TEST_ASSERT_EQUAL_FLOAT(5.0F, working[0]);
    TEST_ASSERT_EQUAL_UINT32(1, slave.generation);
}

void test_a_wrong_key_ends_the_session_and_after_the_third_no_seed_is_given(void)
{
    for (int round = 0; round < 3; round++) {
        master_connect();
        SEND(0xF8, 0, 1);
        EXPECT(0xFF, 4);
        SEND(0xF7, 4, 1, 2, 3, 4);
        EXPECT_ERROR(0x25);
        SEND(0xFD);
        TEST_ASSERT_FALSE(answered);
    }
    master_connect();
    SEND(0xF8, 0, 1);
    EXPECT_ERROR(0x25);
    TEST_ASSERT_EQUAL_UINT32(1, slave.counts.locked_out);
}

void test_a_key_needs_a_seed_and_each_seed_is_different(void)
{
    master_connect();
    SEND(0xF7, 4, 0, 0, 0, 0);
    EXPECT_ERROR(0x29);
    SEND(0xF8, 0, 1);
    const uint8_t first = last_answer.data[2];
    SEND(0xF8, 0, 1);
    TEST_ASSERT_NOT_EQUAL(first, last_answer.data[2]);
}

void test_a_seed_is_given_whole_and_for_calibration_only(void)
{
    master_connect();
    SEND(0xF8, 1, 1); /* the rest of a longer seed */
    EXPECT_ERROR(0x22);
    SEND(0xF8, 0, 4); /* measurement lists, which need no key */
    EXPECT_ERROR(0x22);
}

void test_a_key_of_another_length_is_wrong_even_if_its_bytes_are_right(void)
{
    master_connect();
    SEND(0xF8, 0, 1);
    const uint8_t *seed = &last_answer.data[2];
    SEND(0xF7, 3, (uint8_t)~seed[0], (uint8_t)~seed[1], (uint8_t)~seed[2], (uint8_t)~seed[3]);
    EXPECT_ERROR(0x25);
    TEST_ASSERT_EQUAL_UINT8(1, slave.wrong_keys);
}

/* Locks the slave again and sends the key of this seed, which is the seed's complement. */
static void try_old_key(const uint8_t seed[4])
{
    master_connect();
    SEND(0xF7, 4, (uint8_t)~seed[0], (uint8_t)~seed[1], (uint8_t)~seed[2], (uint8_t)~seed[3]);
    EXPECT_ERROR(0x29);
    SEND(0xFD);
    EXPECT(0xFF, 0x00, 0x01); /* still locked */
    TEST_ASSERT_EQUAL_UINT8(0, slave.wrong_keys);
}

/* A recorded key must not unlock a second time, and a wrong key must not be corrected with the same seed. */
void test_a_seed_is_valid_for_one_key_only(void)
{
    uint8_t seed[4];
    master_connect();
    SEND(0xF8, 0, 1);
    EXPECT(0xFF, 4);
    memcpy(seed, &last_answer.data[2], 4);
    SEND(0xF7, 4, seed[0], seed[1], seed[2], seed[3]);
    EXPECT_ERROR(0x25);
    slave.wrong_keys = 0;
    try_old_key(seed);
    SEND(0xF8, 0, 1);
    memcpy(seed, &last_answer.data[2], 4);
    SEND(0xF7, 4, (uint8_t)~seed[0], (uint8_t)~seed[1], (uint8_t)~seed[2], (uint8_t)~seed[3]);
    EXPECT(0xFF, 0);
    try_old_key(seed);
}

void test_the_limits_themselves_are_allowed_and_what_lies_outside_is_refused(void)
{
    const float good[] = {2.0F, 4.0F};
    const float bad[] = {1.9999998F, 4.0000005F, INFINITY, -INFINITY, NAN};
    ready();
    for (unsigned k = 0; k < 2; k++) {
        write_float(1, good[k]);
        EXPECT(0xFF);
        TEST_ASSERT_EQUAL_FLOAT(good[k], working[1]);
    }
    for (unsigned k = 0; k < sizeof bad / sizeof bad[0]; k++) {
        write_float(1, bad[k]);
        EXPECT_ERROR(0x22);
        TEST_ASSERT_EQUAL_FLOAT(4.0F, working[1]);
    }
}

void test_a_value_acts_only_when_all_its_bytes_have_been_written(void)
{
    const float value = 7.25F;
    uint8_t byte[4];
    memcpy(byte, &value, 4);
    ready();
    for (uint32_t k = 0; k < 4; k++) {
        TEST_ASSERT_EQUAL_FLOAT(1.0F, working[0]);
        master_download(xcp_address(working) + k, &byte[k], 1);
        EXPECT(0xFF);
    }
    TEST_ASSERT_EQUAL_FLOAT(7.25F, working[0]);
    TEST_ASSERT_EQUAL_UINT32(1, slave.generation);
}

void test_a_command_that_completes_a_good_and_a_bad_value_stores_neither(void)
{
    const float block[2] = {9.0F, 99.0F};
    uint8_t bytes[8];
    memcpy(bytes, block, 8);
    ready();
    master_download(xcp_address(working), bytes, 2);
    EXPECT(0xFF);
    master_download(xcp_address(working) + 2, &bytes[2], 6);
    EXPECT_ERROR(0x22);
    TEST_ASSERT_EQUAL_FLOAT(1.0F, working[0]);
    TEST_ASSERT_EQUAL_FLOAT(2.0F, working[1]);
    TEST_ASSERT_EQUAL_UINT32(0, slave.generation);
}

/* A step of the format is 0.25. A smaller value would be stored as zero, which has another meaning. It is refused; zero
 * itself is accepted. */
void test_a_value_that_its_format_would_make_zero_is_refused(void)
{
    const float zero = 0.0F, less = 0.249F, least = 0.25F;
    ready();
    master_download(xcp_address(working), &less, 4);
    EXPECT_ERROR(0x22);
    TEST_ASSERT_EQUAL_FLOAT(1.0F, working[0]);
    master_download(xcp_address(working), &least, 4);
    EXPECT(0xFF);
    TEST_ASSERT_EQUAL_FLOAT(0.25F, working[0]);
    master_download(xcp_address(working), &zero, 4);
    EXPECT(0xFF);
    TEST_ASSERT_EQUAL_FLOAT(0.0F, working[0]);
}

void test_the_master_may_write_the_whole_page_in_pieces_of_any_size(void)
{
    const float page[3] = {0.5F, 2.5F, -0.5F};
    ready();
    for (uint32_t at = 0; at < 12; at += 5) {
        master_download(xcp_address(working) + at, (const uint8_t *)page + at, (uint8_t)((at < 10) ? 5 : 2));
        EXPECT(0xFF);
    }
    TEST_ASSERT_EQUAL_MEMORY(page, working, sizeof page);
}

void test_no_write_outside_the_page_is_accepted(void)
{
    const uint32_t value = 0;
    ready();
    master_download(xcp_address(working) + 10, &value, 4);
    EXPECT_ERROR(0x24);
    master_download(xcp_address(measured), &value, 4);
    EXPECT_ERROR(0x24);
    TEST_ASSERT_EQUAL_HEX8(0xA0, measured[0]);
}

void test_a_download_that_claims_more_bytes_than_it_has_is_refused(void)
{
    ready();
    SEND(0xF6, 0, 0, 0, AT(working));
    SEND(0xF0, 4, 0, 0);
    EXPECT_ERROR(0x21);
    SEND(0xF0, 0, 0, 0);
    EXPECT_ERROR(0x21);
}

void test_the_reference_page_can_be_read_and_not_written(void)
{
    const float three = 3.0F;
    ready();
    write_float(0, 8.0F);
    SEND(0xEB, 0x02, 0, 0); /* select the reference page for the master */
    EXPECT(0xFF);
    SEND(0xF4, 4, 0, 0, AT(working));
    EXPECT(0xFF, 0x00, 0x00, 0x80, 0x3F); /* 1.0 */
    master_download(xcp_address(&working[0]), &three, 4);
    EXPECT_ERROR(0x23);
    TEST_ASSERT_EQUAL_FLOAT(8.0F, working[0]);
}

void test_the_page_of_the_drive_changes_at_once_and_only_with_the_key(void)
{
    ready();
    write_float(0, 8.0F);
    const uint32_t before = slave.generation;
    SEND(0xEB, 0x01, 0, 0);
    EXPECT(0xFF);
    TEST_ASSERT_EQUAL_FLOAT(1.0F, xcp_active_page(&slave, &slave_config)[0]);
    TEST_ASSERT_EQUAL_UINT32(before + 1, slave.generation);
    SEND(0xEA, 1, 0);
    EXPECT(0xFF, 0, 0, 0);
    SEND(0xEA, 2, 0);
    EXPECT(0xFF, 0, 0, 1);
    master_connect(); /* locks the slave again */
    SEND(0xEB, 0x01, 0, 1);
    EXPECT_ERROR(0x25);
}

void test_pages_and_segments_that_do_not_exist_are_refused(void)
{
    ready();
    SEND(0xEB, 0x03, 1, 0);
    EXPECT_ERROR(0x28);
    SEND(0xEB, 0x03, 0, 2);
    EXPECT_ERROR(0x26);
    SEND(0xEB, 0x00, 0, 1);
    EXPECT_ERROR(0x27);
    SEND(0xEA, 3, 0);
    EXPECT_ERROR(0x27);
    SEND(0xEA, 1, 1);
    EXPECT_ERROR(0x28);
    SEND(0xE4, 0, 1, 0, 0);
    EXPECT_ERROR(0x26);
    SEND(0xE4, 0, 0, 0, 0);
    EXPECT_ERROR(0x23);
    SEND(0xE4, 1, 0, 0, 1);
    EXPECT_ERROR(0x28);
    SEND(0xE4, 0, 0, 1, 1);
    EXPECT_ERROR(0x28);
    SEND(0xE4, 0, 0, 0, 2);
    EXPECT_ERROR(0x26);
}

void test_all_segments_at_once_are_the_one_there_is(void)
{
    ready();
    SEND(0xEB, 0x83, 7, 0);
    EXPECT(0xFF);
    SEND(0xEA, 1, 0);
    EXPECT(0xFF, 0, 0, 0);
}

void test_copying_the_reference_page_restores_the_built_in_values(void)
{
    ready();
    write_float(0, 8.0F);
    write_float(2, 4.0F);
    SEND(0xE4, 0, 0, 0, 1);
    EXPECT(0xFF);
    TEST_ASSERT_EQUAL_FLOAT(1.0F, working[0]);
    TEST_ASSERT_EQUAL_FLOAT(3.0F, working[2]);
}

void test_the_checksum_is_that_of_the_bytes(void)
{
    master_connect();
    memcpy(measured, "123456789", 9);
    SEND(0xF6, 0, 0, 0, AT(measured));
    SEND(0xF3, 0, 0, 0, 9, 0, 0, 0);
    EXPECT(0xFF, 0x09, 0, 0, 0x26, 0x39, 0xF4, 0xCB); /* the published check value of CRC-32 */
    SEND(0xF6, 0, 0, 0, AT(measured));
    SEND(0xF3, 0, 0, 0, 0, 0, 1, 0);
    EXPECT_WHOLE(0xFE, 0x22, 0, 0, 0, 0x10, 0, 0); /* with the largest size, 4096 */
    SEND(0xF3, 0, 0, 0, 0, 0, 0, 0);
    EXPECT_WHOLE(0xFE, 0x22, 0, 0, 0, 0x10, 0, 0);
    SEND(0xF3, 0, 0, 0, 1, 0x10, 0, 0);
    EXPECT_WHOLE(0xFE, 0x22, 0, 0, 0, 0x10, 0, 0);
    SEND(0xF3, 0, 0, 0, 0, 0x10, 0, 0);
    EXPECT_ERROR(0x24);
    SEND(0xF3, 0, 0, 0, 17, 0, 0, 0);
    EXPECT_ERROR(0x24);
}

void test_the_checksum_of_the_next_block_follows_without_another_address(void)
{
    master_connect();
    memcpy(&measured[3], "123456789", 9);
    SEND(0xF6, 0, 0, 0, AT(measured));
    SEND(0xF3, 0, 0, 0, 3, 0, 0, 0);
    EXPECT(0xFF, 0x09);
    SEND(0xF3, 0, 0, 0, 9, 0, 0, 0);
    EXPECT_WHOLE(0xFF, 0x09, 0, 0, 0x26, 0x39, 0xF4, 0xCB);
}

/* Blocks of four bytes; what is refused does not move the address. */
void test_a_download_goes_on_where_the_last_one_stopped(void)
{
    ready();
    write_float(0, 5.0F);
    SEND(0xF0, 4, 0, 0, 0x60, 0x40); /* 3.5 */
    EXPECT_WHOLE(0xFF);
    TEST_ASSERT_EQUAL_FLOAT(3.5F, working[1]);
    SEND(0xF0, 4, 0, 0, 0xC8, 0x42); /* 100, out of range */
    EXPECT_ERROR(0x22);
    SEND(0xF0, 4, 0, 0, 0x80, 0x40); /* 4 */
    EXPECT_WHOLE(0xFF);
    TEST_ASSERT_EQUAL_FLOAT(4.0F, working[2]);
}

void test_waiting_bytes_are_discarded_with_the_session(void)
{
    const float value = 7.25F;
    ready();
    master_download(xcp_address(working), &value, 2);
    EXPECT(0xFF);
    ready();
    master_download(xcp_address(working) + 2, (const uint8_t *)&value + 2, 2);
    EXPECT(0xFF);
    TEST_ASSERT_EQUAL_FLOAT(1.0F, working[0]);
}
