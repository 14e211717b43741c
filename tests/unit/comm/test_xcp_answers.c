/* SPDX-License-Identifier: Apache-2.0 */
/* Every command of the XCP slave with the length and all bytes of its answer, as the protocol (ASAM MCD-1 XCP) and
 * docs/howto/xcp.md say. */
#include <string.h>

#include "unity.h"
#include "xcp_master.h"

void setUp(void)
{
    master_reset();
    master_connect();
}

void tearDown(void)
{
}

/* Smallest number of bytes of each command. */
static const struct {
    uint8_t code, length;
} commands[] = {
    {0xFF, 2}, {0xFE, 1}, {0xFD, 1}, {0xFC, 1}, {0xFB, 1}, {0xF8, 3}, {0xF7, 6}, {0xF6, 8},
    {0xF5, 2}, {0xF4, 8}, {0xF3, 8}, {0xF0, 3}, {0xEB, 4}, {0xEA, 3}, {0xE9, 1}, {0xE4, 5},
    {0xE3, 4}, {0xE2, 6}, {0xE1, 8}, {0xE0, 8}, {0xDF, 4}, {0xDE, 4}, {0xDD, 2}, {0xDC, 1},
    {0xDA, 1}, {0xD9, 1}, {0xD7, 4}, {0xD6, 1}, {0xD5, 4}, {0xD4, 5}, {0xD3, 6},
};
#define COMMANDS (sizeof commands / sizeof commands[0])

static bool is_error(uint8_t error)
{
    return last_answer.data[0] == 0xFE && last_answer.data[1] == error;
}

void test_every_command_needs_all_of_its_bytes(void)
{
    for (unsigned n = 0; n < COMMANDS; n++) {
        const uint8_t data[8] = {commands[n].code, (commands[n].code == 0xF0U) ? 1 : 0}; /* a download of one byte */
        setUp();
        master_send(data, commands[n].length);
        TEST_ASSERT_TRUE(answered);
        TEST_ASSERT_FALSE(is_error(0x20) || is_error(0x21));
        if (commands[n].length > 1U) {
            setUp();
            master_send(data, commands[n].length - 1U);
            EXPECT_ERROR(0x21);
        }
    }
}

void test_every_other_code_is_unknown_whatever_its_length(void)
{
    for (unsigned code = 0; code <= 0xFFU; code++) {
        bool known = false;
        for (unsigned n = 0; n < COMMANDS; n++) {
            known = known || commands[n].code == code;
        }
        for (unsigned length = 1; length <= 8U && !known; length++) {
            const uint8_t data[8] = {(uint8_t)code};
            master_send(data, length);
            EXPECT_ERROR(0x20);
        }
    }
}

void test_the_answers_of_a_session(void)
{
    SEND(0xFF, 0);
    EXPECT_WHOLE(0xFF, 0x05, 0x80, 8, 8, 0, 1, 1);
    SEND(0xFD);
    EXPECT_WHOLE(0xFF, 0, 1, 0, 0, 0);
    SEND(0xFB);
    EXPECT_WHOLE(0xFF, 0, 0, 0, 0, 0, 0, 1);
    SEND(0xFC);
    EXPECT_ERROR(0x00);
    SEND(0xF8, 0, 1);
    TEST_ASSERT_EQUAL_UINT8(6, last_answer.length);
    master_unlock();
    TEST_ASSERT_EQUAL_UINT8(2, last_answer.length);
    SEND(0xF8, 0, 1);
    EXPECT_WHOLE(0xFF, 0); /* nothing is left to be unlocked */
    SEND(0xFD);
    EXPECT_WHOLE(0xFF, 0, 0, 0, 0, 0);
    SEND(0xFE);
    EXPECT_WHOLE(0xFF);
}

void test_the_answers_to_access_of_memory_and_pages(void)
{
    master_unlock();
    SEND(0xF6, 0, 0, 0, AT(working));
    EXPECT_WHOLE(0xFF);
    SEND(0xF5, 3);
    EXPECT_WHOLE(0xFF, 0x00, 0x00, 0x80);
    SEND(0xF4, 4, 0, 0, AT(working));
    EXPECT_WHOLE(0xFF, 0x00, 0x00, 0x80, 0x3F);
    SEND(0xEB, 0x83, 0, 1);
    EXPECT_WHOLE(0xFF);
    SEND(0xEA, 1, 0);
    EXPECT_WHOLE(0xFF, 0, 0, 1);
    SEND(0xE9);
    EXPECT_WHOLE(0xFF, 1, 0);
    SEND(0xE4, 0, 0, 0, 1);
    EXPECT_WHOLE(0xFF);
}

/* Only the address extension 0 exists. */
void test_another_address_space_is_refused_and_moves_nothing(void)
{
    SEND(0xF6, 0, 0, 0, AT(measured));
    EXPECT_WHOLE(0xFF);
    SEND(0xF6, 0, 0, 1, AT(&measured[5]));
    EXPECT_ERROR(0x22);
    SEND(0xF4, 4, 0, 1, AT(&measured[5]));
    EXPECT_ERROR(0x22);
    SEND(0xF5, 1);
    EXPECT_WHOLE(0xFF, 0xA0);
}

static void prepare_list(uint8_t list)
{
    SEND(0xD4, 0, list, 0, 1);
    EXPECT_WHOLE(0xFF);
}

void test_the_answers_to_measurement_lists(void)
{
    SEND(0xD6);
    EXPECT_WHOLE(0xFF);
    SEND(0xD5, 0, 2, 0);
    EXPECT_WHOLE(0xFF);
    prepare_list(0);
    prepare_list(1);
    SEND(0xD3, 0, 1, 0, 0, 1);
    EXPECT_WHOLE(0xFF);
    SEND(0xE2, 0, 1, 0, 0, 0);
    EXPECT_WHOLE(0xFF);
    SEND(0xE1, 0xFF, 1, 0, AT(measured));
    EXPECT_WHOLE(0xFF);
    SEND(0xDF, 0, 1, 0);
    EXPECT_WHOLE(0xFF, 0, 0, 0, 0, 0, 1, 0);
    SEND(0xE0, 0x10, 1, 0, 1, 0, 9, 0);
    EXPECT_WHOLE(0xFF);
    SEND(0xDF, 0, 1, 0);
    EXPECT_WHOLE(0xFF, 0x10, 0, 0, 1, 0, 9, 0);
    SEND(0xDE, 2, 1, 0);
    EXPECT_WHOLE(0xFF, 1); /* the first frame of this list */
    SEND(0xDF, 0, 1, 0);
    EXPECT_WHOLE(0xFF, 0x11, 0, 0, 1, 0, 9, 0);
    SEND(0xDD, 1);
    EXPECT_WHOLE(0xFF);
    SEND(0xDF, 0, 1, 0);
    EXPECT_WHOLE(0xFF, 0x50, 0, 0, 1, 0, 9, 0);
    SEND(0xE3, 0, 1, 0);
    EXPECT_WHOLE(0xFF);
    SEND(0xDA);
    EXPECT_WHOLE(0xFF, 0x93, XCP_DAQ_LISTS, 0, XCP_DAQ_EVENTS, 0, 0, 0);
    SEND(0xD9);
    EXPECT_WHOLE(0xFF, 1, 7, 1, 0, 0x62, 1, 0);
    SEND(0xDC);
    EXPECT_WHOLE(0xFF, 0, 0, 0, 0, 0, 0, 0);
    SEND(0xD7, 0, 0, 0);
    EXPECT_WHOLE(0xFF, 0x04, XCP_DAQ_LISTS, 0, 1, 6, 0);
}

void test_commands_and_refusals_are_counted(void)
{
    const xcp_counts_t before = slave.counts;
    SEND(0xFD);
    SEND(0x01);
    SEND(0xFC); /* synchronisation is answered by an error, but nothing was refused */
    TEST_ASSERT_EQUAL_UINT32(before.commands + 3U, slave.counts.commands);
    TEST_ASSERT_EQUAL_UINT32(before.refused + 1U, slave.counts.refused);
}

void test_a_command_that_the_caller_has_carried_out_is_answered_and_counted(void)
{
    const xcp_counts_t before = slave.counts;
    memset(&last_answer, 0xEE, sizeof last_answer);
    answered = true;
    xcp_answer(&slave, XCP_OK, &last_answer);
    EXPECT_WHOLE(0xFF);
    xcp_answer(&slave, XCP_ERR_CMD_BUSY, &last_answer);
    EXPECT_ERROR(0x10);
    TEST_ASSERT_EQUAL_UINT32(before.commands + 2U, slave.counts.commands);
    TEST_ASSERT_EQUAL_UINT32(before.refused + 1U, slave.counts.refused);
}

/* 0 would mean that no seed was given. Before the first seed the counter is at its end here. */
void test_a_seed_is_never_zero(void)
{
    xcp_reset(&slave, &slave_config, UINT32_MAX);
    master_connect();
    master_unlock();
}

static void send_wrong_key(void)
{
    master_connect();
    SEND(0xF8, 0, 1);
    EXPECT(0xFF, 4);
    SEND(0xF7, 4, 1, 2, 3, 4);
    EXPECT_ERROR(0x25);
}

void test_a_right_key_ends_the_count_of_wrong_ones(void)
{
    for (int round = 0; round < 3; round++) {
        send_wrong_key();
        send_wrong_key();
        master_connect();
        master_unlock();
    }
}

/* A key that was recorded after one start must not be right after the next. */
void test_the_first_seed_depends_on_the_seed_of_the_start(void)
{
    uint8_t first[2][4];
    for (uint32_t n = 0; n < 2U; n++) {
        xcp_reset(&slave, &slave_config, 7U + n);
        master_connect();
        SEND(0xF8, 0, 1);
        memcpy(first[n], &last_answer.data[2], 4);
    }
    TEST_ASSERT_TRUE(memcmp(first[0], first[1], 4) != 0);
}
