/* SPDX-License-Identifier: Apache-2.0 */
#include <stdlib.h>
#include <string.h>

#include "socketcand.h"
#include "unity.h"

static can_frame_t frame;

void setUp(void)
{
}

void tearDown(void)
{
}

/* The texts are those that python-can writes. */
void test_a_frame_is_read_as_a_client_writes_it(void)
{
    TEST_ASSERT_EQUAL_INT(SOCKETCAND_SEND, socketcand_parse(" send 123 3 1 ab ff ", &frame));
    TEST_ASSERT_EQUAL_HEX32(0x123, frame.id);
    TEST_ASSERT_FALSE(frame.extended);
    TEST_ASSERT_EQUAL_UINT8(3, frame.length);
    TEST_ASSERT_EQUAL_HEX8_ARRAY("\x01\xab\xff", frame.data, 3);
    TEST_ASSERT_EQUAL_INT(SOCKETCAND_SEND, socketcand_parse(" send 00000123 0  ", &frame));
    TEST_ASSERT_TRUE(frame.extended);
    TEST_ASSERT_EQUAL_UINT8(0, frame.length);
    TEST_ASSERT_EQUAL_INT(SOCKETCAND_SEND, socketcand_parse(" send 1FFFFFFF 8 0 1 2 3 4 5 6 7 ", &frame));
    TEST_ASSERT_EQUAL_HEX32(0x1FFFFFFF, frame.id);
}

void test_the_commands_open_and_rawmode_are_known(void)
{
    TEST_ASSERT_EQUAL_INT(SOCKETCAND_OPEN, socketcand_parse(" open can0 ", &frame));
    TEST_ASSERT_EQUAL_INT(SOCKETCAND_RAW, socketcand_parse(" rawmode ", &frame));
}

void test_everything_else_is_bad(void)
{
    static const char *const bad[] = {
        "",
        " ",
        "send",
        "send ",
        "send 123",
        "send 800 0",
        "send FFF 0",
        "send 20000000 0",
        "send 1234 0",
        "send 123 9",
        "send 123 8 1 2 3",
        "send 123 1 1 2",
        "send 123 1 100",
        "send 123 1 1x",
        "send 123 1 -1",
        "send 12g 0",
        "send 123456789 0",
        "send 123 01",
        "rawmode now",
        "opencan0",
        "SEND 123 0",
        "send 123 1 +1",
        "send 123 2 1,2",
        "send 123 1 0x1",
    };
    for (size_t i = 0; i < sizeof bad / sizeof bad[0]; i++) {
        TEST_ASSERT_EQUAL_INT_MESSAGE(SOCKETCAND_BAD, socketcand_parse(bad[i], &frame), bad[i]);
    }
}

void test_a_frame_is_written_as_a_client_reads_it(void)
{
    char text[SOCKETCAND_TEXT];
    const can_frame_t standard = {.id = 0x07F, .length = 2, .data = {0x0A, 0xFF}};
    size_t length = socketcand_format(text, &standard, 12345678901234ULL);
    TEST_ASSERT_EQUAL_STRING("< frame 07F 12345.678901 0AFF >", text);
    TEST_ASSERT_EQUAL_size_t(strlen(text), length);
    const can_frame_t empty = {.id = 0x123, .extended = true};
    (void)socketcand_format(text, &empty, 1000);
    TEST_ASSERT_EQUAL_STRING("< frame 00000123 0.000001  >", text); /* two spaces: the field of the data is empty */
    const can_frame_t longest = {.id = 0x1FFFFFFF, .extended = true, .length = 8};
    length = socketcand_format(text, &longest, UINT64_MAX);
    TEST_ASSERT_LESS_THAN_size_t(SOCKETCAND_TEXT, length);
}

/* Valid texts with some characters replaced give no frame that is impossible on a bus. The sanitizers report accesses
 * outside the text. */
void test_a_million_damaged_texts_give_no_impossible_frame(void)
{
    static const char alphabet[] = "send open rawmode 0123456789abcdefABCDEFxg<>\t\xff";
    static const char *const good[] = {" send 123 3 1 ab ff ", " send 1FFFFFFF 8 0 1 2 3 4 5 6 7 ", " send 7FF 0  "};
    char text[64];
    int accepted = 0;
    srand(1);
    for (int i = 0; i < 1000000; i++) {
        (void)strcpy(text, good[i % 3]);
        for (int k = rand() % 4; k > 0; k--) {
            text[(size_t)rand() % strlen(good[i % 3])] = alphabet[(size_t)rand() % (sizeof alphabet - 1U)];
        }
        if (socketcand_parse(text, &frame) == SOCKETCAND_SEND) {
            accepted++;
            TEST_ASSERT_TRUE(frame.length <= 8 && frame.id <= (frame.extended ? 0x1FFFFFFFU : 0x7FFU));
        }
    }
    TEST_ASSERT_INT_WITHIN(400000, 500000, accepted); /* some texts are accepted and some refused */
}
