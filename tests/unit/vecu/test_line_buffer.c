/* SPDX-License-Identifier: Apache-2.0 */
#include <stdlib.h>
#include <string.h>

#include "line_buffer.h"
#include "unity.h"

static line_buffer_t buffer;
static char text[LINE_LENGTH + 1];

void setUp(void)
{
    memset(&buffer, 0, sizeof buffer);
}

void tearDown(void)
{
}

static void feed_bytes(const char *bytes, size_t count)
{
    TEST_ASSERT_LESS_OR_EQUAL_size_t(line_buffer_free(&buffer), count);
    memcpy(buffer.bytes + buffer.end, bytes, count);
    buffer.end += count;
}

static void feed(const char *bytes)
{
    feed_bytes(bytes, strlen(bytes));
}

static void next_is(const char *wanted)
{
    TEST_ASSERT_TRUE(line_buffer_next(&buffer, text));
    TEST_ASSERT_EQUAL_STRING(wanted, text);
}

static void nothing(void)
{
    TEST_ASSERT_FALSE(line_buffer_next(&buffer, text));
}

void test_lines_are_found_in_portions_of_any_size(void)
{
    feed("one\ntwo\nth");
    next_is("one");
    next_is("two");
    nothing();
    feed("ree\n\n");
    next_is("three");
    next_is("");
    nothing();
    TEST_ASSERT_EQUAL_UINT64(0, buffer.dropped);
}

void test_a_line_that_is_too_long_is_dropped_whole_and_counted_once(void)
{
    char piece[1000];
    memset(piece, 'x', sizeof piece);
    for (int i = 0; i < 5; i++) {
        feed_bytes(piece, sizeof piece);
        nothing();
    }
    feed("tail\ngood\n");
    next_is("good");
    TEST_ASSERT_EQUAL_UINT64(1, buffer.dropped);
}

void test_the_longest_line_is_taken_and_one_more_is_not(void)
{
    char piece[LINE_LENGTH + 2];
    memset(piece, 'x', sizeof piece);
    piece[LINE_LENGTH] = '\n';
    feed_bytes(piece, LINE_LENGTH + 1);
    TEST_ASSERT_TRUE(line_buffer_next(&buffer, text));
    TEST_ASSERT_EQUAL_size_t(LINE_LENGTH, strlen(text));
    piece[LINE_LENGTH] = 'x';
    piece[LINE_LENGTH + 1] = '\n';
    feed_bytes(piece, LINE_LENGTH + 2);
    nothing();
    TEST_ASSERT_EQUAL_UINT64(1, buffer.dropped);
}

void test_a_line_with_a_nul_in_it_is_dropped(void)
{
    feed_bytes("a\0b\nc\n", 6);
    next_is("c");
    TEST_ASSERT_EQUAL_UINT64(1, buffer.dropped);
}

void test_words_in_brackets_are_found_and_white_space_between_them_is_ignored(void)
{
    buffer.framing = LINE_IN_BRACKETS;
    feed("< one >< two >\r\n \t< thr");
    next_is(" one ");
    next_is(" two ");
    nothing();
    feed("ee >");
    next_is(" three ");
    TEST_ASSERT_EQUAL_UINT64(0, buffer.dropped);
    TEST_ASSERT_TRUE(line_buffer_empty(&buffer));
}

void test_bytes_outside_brackets_and_words_without_an_end_are_counted(void)
{
    buffer.framing = LINE_IN_BRACKETS;
    feed("rubbish< good >more< half < good >>");
    next_is(" good ");
    next_is(" good ");
    nothing();
    TEST_ASSERT_EQUAL_UINT64(4, buffer.dropped); /* rubbish, more, half, the last '>' */
}

void test_a_word_in_brackets_that_is_too_long_is_dropped(void)
{
    char piece[LINE_LENGTH + 10];
    memset(piece, 'x', sizeof piece);
    piece[0] = '<';
    buffer.framing = LINE_IN_BRACKETS;
    feed_bytes(piece, sizeof piece);
    nothing();
    feed("end >< good >");
    next_is(" good ");
    TEST_ASSERT_GREATER_OR_EQUAL_UINT64(1, buffer.dropped);
}

/* With any bytes in portions of any size there is always free space again, and no text is longer than allowed. The
 * sanitizers report accesses outside the buffer. */
void test_random_bytes_never_fill_the_buffer_for_good(void)
{
    srand(2);
    for (int framing = 0; framing < 2; framing++) {
        setUp();
        buffer.framing = framing == 0 ? LINE_BY_NEWLINE : LINE_IN_BRACKETS;
        for (int i = 0; i < 2000; i++) {
            const size_t free_bytes = line_buffer_free(&buffer);
            TEST_ASSERT_GREATER_THAN_size_t(0, free_bytes);
            const size_t count = (size_t)rand() % (free_bytes + 1U);
            const int rare = rand() % 200 + 3;
            for (size_t k = 0; k < count; k++) {
                const int pick = rand() % rare;
                buffer.bytes[buffer.end++] = (char)(pick == 0   ? '<'
                                                    : pick == 1 ? '>'
                                                    : pick == 2 ? '\n'
                                                                : rand() % 256 - 128);
            }
            while (line_buffer_next(&buffer, text)) {
                TEST_ASSERT_LESS_OR_EQUAL_size_t(LINE_LENGTH, strlen(text));
            }
        }
    }
}
