/* SPDX-License-Identifier: Apache-2.0 */
#include <string.h>

#include "unity.h"
#include "xcp_master.h"

static can_frame_t dto;

void setUp(void)
{
    master_reset();
    master_connect();
}

void tearDown(void)
{
}

static void event(void)
{
    xcp_daq_event(&slave.daq, &slave_config.memory, 1);
}

static bool next(void)
{
    if (!xcp_daq_next(&slave.daq, &dto)) {
        return false;
    }
    xcp_daq_sent(&slave.daq);
    return true;
}

/* One list of one frame: two bytes from measured[1], one from measured[9]. */
static void one_list(uint8_t event_number, uint8_t prescaler, uint8_t mode)
{
    SEND(0xD6);
    SEND(0xD5, 0, 1, 0);
    SEND(0xD4, 0, 0, 0, 1);
    SEND(0xD3, 0, 0, 0, 0, 2);
    SEND(0xE2, 0, 0, 0, 0, 0);
    SEND(0xE1, 0xFF, 2, 0, AT(&measured[1]));
    EXPECT(0xFF);
    SEND(0xE1, 0xFF, 1, 0, AT(&measured[9]));
    EXPECT(0xFF);
    SEND(0xE0, mode, 0, 0, event_number, 0, prescaler, 0);
    EXPECT(0xFF);
}

static void start(void)
{
    SEND(0xDE, 2, 0, 0);
    EXPECT(0xFF, 0);
    SEND(0xDD, 1);
    EXPECT(0xFF);
}

/* Two lists of one frame with one byte: measured[3] and measured[4]. */
static void two_lists(void)
{
    SEND(0xD6);
    SEND(0xD5, 0, 2, 0);
    for (uint8_t list = 0; list < 2; list++) {
        SEND(0xD4, 0, list, 0, 1);
    }
    for (uint8_t list = 0; list < 2; list++) {
        SEND(0xD3, 0, list, 0, 0, 1);
        SEND(0xE2, 0, list, 0, 0, 0);
        SEND(0xE1, 0xFF, 1, 0, AT(&measured[3 + list]));
        EXPECT(0xFF);
    }
}

void test_a_running_list_sends_its_bytes_each_millisecond(void)
{
    one_list(0, 1, 0x10);
    event();
    TEST_ASSERT_FALSE(next());
    start();
    for (uint16_t ms = 2; ms < 400; ms++) {
        measured[1] = (uint8_t)ms;
        event();
        TEST_ASSERT_TRUE(next());
        const uint8_t expected[6] = {0, (uint8_t)ms, (uint8_t)(ms >> 8), (uint8_t)ms, 0xA2, 0xA9};
        TEST_ASSERT_EQUAL_UINT8(6, dto.length);
        TEST_ASSERT_EQUAL_HEX8_ARRAY(expected, dto.data, 6);
        TEST_ASSERT_FALSE(next());
    }
}

void test_the_slow_event_occurs_every_tenth_millisecond_and_the_prescaler_divides_it(void)
{
    const struct {
        uint8_t event, prescaler;
        int frames;
    } cases[] = {{0, 1, 120}, {0, 5, 24}, {1, 1, 12}, {1, 3, 4}};
    for (unsigned k = 0; k < sizeof cases / sizeof cases[0]; k++) {
        one_list(cases[k].event, cases[k].prescaler, 0);
        start();
        int frames = 0;
        for (int ms = 0; ms < 120; ms++) {
            event();
            frames += next() ? 1 : 0;
        }
        TEST_ASSERT_EQUAL_INT(cases[k].frames, frames);
    }
}

void test_stopping_selected_lists_or_all_of_them_ends_the_stream(void)
{
    for (uint8_t mode = 0; mode <= 2; mode += 2) {
        one_list(0, 1, 0);
        start();
        SEND(0xFD);
        EXPECT(0xFF, 0x40);
        SEND(0xDE, 2, 0, 0);
        SEND(0xDD, mode);
        EXPECT(0xFF);
        event();
        TEST_ASSERT_FALSE(next());
        SEND(0xFD);
        EXPECT(0xFF, 0x00);
    }
}

void test_a_list_that_does_not_fit_is_dropped_whole_and_announced(void)
{
    one_list(0, 1, 0);
    start();
    for (int ms = 0; ms < 200; ms++) {
        event();
    }
    int frames = 0;
    int events = 0;
    while (next()) {
        events += dto.data[0] == 0xFD && dto.data[1] == 0x06 && dto.length == 2;
        frames += dto.data[0] == 0;
    }
    TEST_ASSERT_EQUAL_INT(XCP_DAQ_QUEUE - 1, frames);
    TEST_ASSERT_EQUAL_INT(1, events);
    TEST_ASSERT_EQUAL_UINT32(200 - (XCP_DAQ_QUEUE - 1), slave.daq.overloads);
    event();
    TEST_ASSERT_TRUE(next());
    TEST_ASSERT_TRUE(next()); /* of the lists that were dropped after the first announcement */
    TEST_ASSERT_EQUAL_HEX8(0xFD, dto.data[0]);
    for (int ms = 0; ms < 5; ms++) { /* nothing is announced any more */
        event();
        TEST_ASSERT_TRUE(next());
        TEST_ASSERT_EQUAL_HEX8(0, dto.data[0]);
        TEST_ASSERT_FALSE(next());
    }
}

void test_allocation_has_a_fixed_order_and_limits(void)
{
    SEND(0xD4, 0, 0, 0, 1);
    EXPECT_ERROR(0x29);
    SEND(0xD3, 0, 0, 0, 0, 1);
    EXPECT_ERROR(0x29);
    SEND(0xD5, 0, XCP_DAQ_LISTS + 1, 0);
    EXPECT_ERROR(0x30);
    SEND(0xD5, 0, 2, 0);
    EXPECT(0xFF);
    SEND(0xD5, 0, 2, 0);
    EXPECT_ERROR(0x29);
    SEND(0xD4, 0, 2, 0, 1);
    EXPECT_ERROR(0x22);
    SEND(0xD4, 0, 0, 0, XCP_DAQ_ODTS + 1);
    EXPECT_ERROR(0x30);
    SEND(0xD4, 0, 0, 0, XCP_DAQ_ODTS);
    EXPECT(0xFF);
    SEND(0xD4, 0, 0, 0, 1);
    EXPECT_ERROR(0x22); /* the list has its frames */
    SEND(0xD4, 0, 1, 0, 1);
    EXPECT_ERROR(0x30);
    SEND(0xD3, 0, 2, 0, 0, 1);
    EXPECT_ERROR(0x22);
    SEND(0xD3, 0, 0, 0, 0, 8);
    EXPECT_ERROR(0x30);
    SEND(0xD3, 0, 0, 0, XCP_DAQ_ODTS, 1);
    EXPECT_ERROR(0x22);
}

/* 10 frames of 7 entries, then a frame of the last two; a third one would be too many. */
void test_the_pool_of_entries_can_be_used_up_to_its_last_entry(void)
{
    SEND(0xD5, 0, 1, 0);
    SEND(0xD4, 0, 0, 0, 12);
    for (uint8_t odt = 0; odt < 10; odt++) {
        SEND(0xD3, 0, 0, 0, odt, 7);
        EXPECT_WHOLE(0xFF);
    }
    SEND(0xD3, 0, 0, 0, 10, 3);
    EXPECT_ERROR(0x30);
    SEND(0xD3, 0, 0, 0, 10, 2);
    EXPECT_WHOLE(0xFF);
    SEND(0xD3, 0, 0, 0, 11, 1);
    EXPECT_ERROR(0x30);
}

void test_a_frame_takes_its_entries_once_also_a_single_one(void)
{
    SEND(0xD5, 0, 1, 0);
    SEND(0xD4, 0, 0, 0, 1);
    SEND(0xD4, 0, 0, 0, 1);
    EXPECT_ERROR(0x22);
    SEND(0xD3, 0, 0, 0, 0, 1);
    EXPECT_WHOLE(0xFF);
    SEND(0xD3, 0, 0, 0, 0, 1);
    EXPECT_ERROR(0x22);
    SEND(0xD4, 0, 0, 0, 1); /* entries were allocated: no more frames */
    EXPECT_ERROR(0x29);
}

/* WRITE_DAQ would write to the entry that was selected before. */
void test_a_pointer_that_was_refused_selects_nothing(void)
{
    static const uint8_t wrong[][3] = {{2, 0, 0}, {3, 0, 0}, {0, 1, 0}, {0, 2, 0}, {0, 0, 1}, {1, 1, 0}};
    for (unsigned n = 0; n < sizeof wrong / sizeof wrong[0]; n++) {
        two_lists();
        SEND(0xE2, 0, 0, 0, 0, 0);
        EXPECT_WHOLE(0xFF);
        SEND(0xE2, 0, wrong[n][0], 0, wrong[n][1], wrong[n][2]);
        EXPECT_ERROR(0x22);
        SEND(0xE1, 0xFF, 1, 0, AT(measured));
        EXPECT_ERROR(0x29);
    }
}

/* The first list has three frames. */
void test_clearing_a_list_clears_all_of_its_frames_and_no_others(void)
{
    SEND(0xD5, 0, 2, 0);
    SEND(0xD4, 0, 0, 0, 3);
    SEND(0xD4, 0, 1, 0, 1);
    for (uint8_t odt = 0; odt < 4; odt++) {
        SEND(0xD3, 0, odt / 3U, 0, odt % 3U, 1);
        SEND(0xE2, 0, odt / 3U, 0, odt % 3U, 0);
        SEND(0xE1, 0xFF, 1, 0, AT(measured));
        EXPECT_WHOLE(0xFF);
    }
    SEND(0xDE, 2, 0, 0);
    EXPECT_WHOLE(0xFF, 0);
    SEND(0xE3, 0, 0, 0);
    EXPECT_WHOLE(0xFF);
    SEND(0xDF, 0, 0, 0);
    EXPECT(0xFF, 0x00);                     /* not selected any more */
    for (uint8_t odt = 0; odt < 2; odt++) { /* written again, but for the last frame */
        SEND(0xE2, 0, 0, 0, odt, 0);
        SEND(0xE1, 0xFF, 1, 0, AT(measured));
    }
    SEND(0xDE, 1, 0, 0);
    EXPECT_ERROR(0x2A);
    SEND(0xDE, 1, 1, 0);
    EXPECT_WHOLE(0xFF, 3);
}

void test_freeing_the_lists_keeps_the_count_of_dropped_ones(void)
{
    one_list(0, 1, 0);
    start();
    for (int ms = 0; ms < 200; ms++) {
        event();
    }
    const uint32_t dropped = slave.daq.overloads;
    TEST_ASSERT_GREATER_THAN_UINT32(0, dropped);
    SEND(0xD6);
    TEST_ASSERT_EQUAL_UINT32(dropped, slave.daq.overloads);
}

void test_more_entries_than_the_pool_has_are_refused(void)
{
    SEND(0xD5, 0, 1, 0);
    SEND(0xD4, 0, 0, 0, XCP_DAQ_ODTS);
    int granted = 0;
    for (uint8_t odt = 0; odt < XCP_DAQ_ODTS; odt++) {
        SEND(0xD3, 0, 0, 0, odt, 7);
        granted += (last_answer.data[0] == 0xFF) ? 7 : 0;
    }
    TEST_ASSERT_EQUAL_INT(XCP_DAQ_ENTRIES / 7 * 7, granted);
}

void test_a_list_with_an_empty_entry_or_a_frame_that_is_too_long_does_not_start(void)
{
    SEND(0xD6);
    SEND(0xD5, 0, 1, 0);
    SEND(0xD4, 0, 0, 0, 1);
    SEND(0xD3, 0, 0, 0, 0, 2);
    SEND(0xE2, 0, 0, 0, 0, 0);
    SEND(0xE1, 0xFF, 4, 0, AT(measured));
    SEND(0xDE, 1, 0, 0);
    EXPECT_ERROR(0x2A);
    SEND(0xE1, 0xFF, 4, 0, AT(measured));
    SEND(0xDE, 1, 0, 0);
    EXPECT_ERROR(0x2A);
}

void test_only_the_selected_lists_are_started(void)
{
    for (uint8_t list = 0; list < 2; list++) {
        two_lists();
        SEND(0xDE, 2, list, 0);
        SEND(0xDD, 1);
        EXPECT(0xFF);
        SEND(0xFD);
        EXPECT(0xFF, 0x40);
        event();
        TEST_ASSERT_TRUE(next());
        TEST_ASSERT_EQUAL_HEX8(list, dto.data[0]);
        TEST_ASSERT_EQUAL_HEX8(0xA3 + list, dto.data[1]);
        TEST_ASSERT_FALSE(next());
    }
}

void test_a_list_that_is_not_selected_may_be_incomplete_and_may_be_stopped(void)
{
    two_lists();
    SEND(0xE3, 0, 0, 0);
    SEND(0xDE, 2, 1, 0);
    SEND(0xDD, 1);
    EXPECT(0xFF);
    SEND(0xDE, 0, 0, 0);
    EXPECT(0xFF, 0);
}

/* The first frame has the time stamp and 2 bytes, the second one 7 bytes, which fill it. */
void test_the_time_stamp_is_in_the_first_frame_of_a_list_only(void)
{
    SEND(0xD5, 0, 1, 0);
    SEND(0xD4, 0, 0, 0, 2);
    for (uint8_t odt = 0; odt < 2; odt++) {
        SEND(0xD3, 0, 0, 0, odt, 1);
        SEND(0xE2, 0, 0, 0, odt, 0);
        SEND(0xE1, 0xFF, (odt == 0) ? 2 : 7, 0, AT(measured));
        EXPECT(0xFF);
    }
    SEND(0xE0, 0x10, 0, 0, 0, 0, 1, 0);
    start();
    event();
    const uint8_t expected[2][8] = {{0, 1, 0, 0xA0, 0xA1}, {1, 0xA0, 0xA1, 0xA2, 0xA3, 0xA4, 0xA5, 0xA6}};
    for (unsigned odt = 0; odt < 2; odt++) {
        TEST_ASSERT_TRUE(next());
        TEST_ASSERT_EQUAL_UINT8((odt == 0) ? 5 : 8, dto.length);
        TEST_ASSERT_EQUAL_HEX8_ARRAY(expected[odt], dto.data, dto.length);
    }
    TEST_ASSERT_FALSE(next());
}

void test_a_list_with_a_frame_that_has_no_entry_does_not_start(void)
{
    for (uint8_t without = 0; without < 2; without++) {
        SEND(0xD6);
        SEND(0xD5, 0, 1, 0);
        SEND(0xD4, 0, 0, 0, 2);
        SEND(0xD3, 0, 0, 0, 1U - without, 1);
        SEND(0xE2, 0, 0, 0, 1U - without, 0);
        SEND(0xE1, 0xFF, 1, 0, AT(measured));
        EXPECT(0xFF);
        SEND(0xDE, 1, 0, 0);
        EXPECT_ERROR(0x2A);
    }
}

void test_the_time_stamp_counts_against_the_frame(void)
{
    SEND(0xD5, 0, 1, 0);
    SEND(0xD4, 0, 0, 0, 1);
    SEND(0xD3, 0, 0, 0, 0, 1);
    SEND(0xE2, 0, 0, 0, 0, 0);
    SEND(0xE1, 0xFF, 6, 0, AT(measured));
    SEND(0xE0, 0x10, 0, 0, 0, 0, 1, 0);
    SEND(0xDE, 1, 0, 0);
    EXPECT_ERROR(0x2A);
    SEND(0xE0, 0x00, 0, 0, 0, 0, 1, 0);
    SEND(0xDE, 1, 0, 0);
    EXPECT(0xFF, 0);
}

void test_an_entry_reads_only_what_may_be_read(void)
{
    SEND(0xD5, 0, 1, 0);
    SEND(0xD4, 0, 0, 0, 1);
    SEND(0xD3, 0, 0, 0, 0, 1);
    SEND(0xE1, 0xFF, 1, 0, AT(measured));
    EXPECT_ERROR(0x29); /* no entry has been selected */
    SEND(0xE2, 0, 0, 0, 0, 0);
    SEND(0xE1, 0xFF, 1, 0, AT(&slave));
    EXPECT_ERROR(0x24);
    SEND(0xE1, 0x03, 1, 0, AT(measured));
    EXPECT_ERROR(0x22);
    SEND(0xE1, 0xFF, 8, 0, AT(measured));
    EXPECT_ERROR(0x22);
    SEND(0xE1, 0xFF, 0, 0, AT(measured));
    EXPECT_ERROR(0x22);
    SEND(0xE1, 0xFF, 1, 1, AT(measured)); /* another address space */
    EXPECT_ERROR(0x22);
    SEND(0xE1, 0xFF, 1, 0, AT(measured));
    EXPECT(0xFF);
    SEND(0xE1, 0xFF, 1, 0, AT(measured));
    EXPECT_ERROR(0x29); /* after the last entry */
}

void test_a_running_list_cannot_be_changed(void)
{
    one_list(0, 1, 0);
    start();
    SEND(0xE2, 0, 0, 0, 0, 0);
    EXPECT_ERROR(0x11);
    SEND(0xE0, 0, 0, 0, 0, 0, 1, 0);
    EXPECT_ERROR(0x11);
}

/* The entry was selected before the start: WRITE_DAQ would make the frame longer than eight bytes. */
void test_an_entry_cannot_be_written_into_a_list_that_was_started_meanwhile(void)
{
    one_list(0, 1, 0);
    SEND(0xE2, 0, 0, 0, 0, 0);
    start();
    SEND(0xE1, 0xFF, 7, 0, AT(measured));
    EXPECT_ERROR(0x11);
    event();
    TEST_ASSERT_TRUE(next());
    TEST_ASSERT_EQUAL_UINT8(4, dto.length);
}

/* Two lists are selected; afterwards an entry or the time stamp makes the second one too long. */
void test_lists_that_changed_after_they_were_selected_start_together_or_not_at_all(void)
{
    for (unsigned by_entry = 0; by_entry < 2; by_entry++) {
        SEND(0xD6);
        SEND(0xD5, 0, 2, 0);
        for (uint8_t list = 0; list < 2; list++) {
            SEND(0xD4, 0, list, 0, 1);
        }
        for (uint8_t list = 0; list < 2; list++) {
            SEND(0xD3, 0, list, 0, 0, 2);
            SEND(0xE2, 0, list, 0, 0, 0);
            SEND(0xE1, 0xFF, 3, 0, AT(measured));
            SEND(0xE1, 0xFF, 3, 0, AT(measured));
            SEND(0xDE, 2, list, 0);
            EXPECT(0xFF);
        }
        if (by_entry) {
            SEND(0xE2, 0, 1, 0, 0, 0);
            SEND(0xE1, 0xFF, 7, 0, AT(measured));
        } else {
            SEND(0xE0, 0x10, 1, 0, 0, 0, 1, 0);
        }
        EXPECT(0xFF);
        SEND(0xDD, 1);
        EXPECT_ERROR(0x2A);
        event();
        TEST_ASSERT_FALSE(next());
    }
}

void test_a_list_is_started_and_stopped_by_its_number(void)
{
    one_list(0, 1, 0);
    SEND(0xDE, 1, 0, 0);
    EXPECT_WHOLE(0xFF, 0);
    SEND(0xDF, 0, 0, 0);
    EXPECT(0xFF, 0x40);
    event();
    TEST_ASSERT_TRUE(next());
    SEND(0xDE, 0, 0, 0);
    EXPECT_WHOLE(0xFF, 0);
    SEND(0xDF, 0, 0, 0);
    EXPECT(0xFF, 0x00);
    event();
    TEST_ASSERT_FALSE(next());
}

void test_a_list_without_frames_does_not_start(void)
{
    SEND(0xD5, 0, 1, 0);
    SEND(0xDE, 1, 0, 0);
    EXPECT_ERROR(0x2A);
}

void test_a_list_that_is_started_again_is_sampled_in_the_next_step_whatever_its_prescaler(void)
{
    one_list(0, 5, 0);
    for (int n = 0; n < 3; n++) {
        SEND(0xDE, 1, 0, 0);
        event();
        TEST_ASSERT_TRUE(next());
        event();
        TEST_ASSERT_FALSE(next());
        SEND(0xDE, 0, 0, 0);
    }
}

/* All lists that there are, and the frames behind them in memory. */
void test_with_all_lists_in_use_none_runs_by_itself(void)
{
    SEND(0xD5, 0, XCP_DAQ_LISTS, 0);
    for (uint8_t list = 0; list < XCP_DAQ_LISTS; list++) {
        SEND(0xD4, 0, list, 0, 2);
        EXPECT(0xFF);
    }
    for (uint8_t odt = 0; odt < 2U * XCP_DAQ_LISTS; odt++) {
        SEND(0xD3, 0, odt / 2U, 0, odt % 2U, 3);
        EXPECT(0xFF);
    }
    SEND(0xFD);
    EXPECT(0xFF, 0x00);
    event();
    TEST_ASSERT_FALSE(next());
    SEND(0xDD, 0); /* stops all lists, and only them: the fourth frame keeps its entries */
    EXPECT_WHOLE(0xFF);
    SEND(0xD3, 0, 1, 0, 1, 1);
    EXPECT_ERROR(0x22);
    SEND(0xD3, 0, XCP_DAQ_LISTS, 0, 0, 1);
    EXPECT_ERROR(0x22);
    SEND(0xE2, 0, XCP_DAQ_LISTS, 0, 0, 0);
    EXPECT_ERROR(0x22);
}

void test_numbers_that_do_not_exist_are_refused(void)
{
    one_list(0, 1, 0);
    SEND(0xE2, 0, 1, 0, 0, 0);
    EXPECT_ERROR(0x22);
    SEND(0xE2, 0, 0, 0, 1, 0);
    EXPECT_ERROR(0x22);
    SEND(0xE2, 0, 0, 0, 0, 2);
    EXPECT_ERROR(0x22);
    SEND(0xE0, 0, 1, 0, 0, 0, 1, 0);
    EXPECT_ERROR(0x22);
    SEND(0xE0, 0, 0, 0, XCP_DAQ_EVENTS, 0, 1, 0);
    EXPECT_ERROR(0x22);
    SEND(0xE0, 0, 0, 0, 0, 0, 0, 0);
    EXPECT_ERROR(0x22);
    SEND(0xE0, 0x02, 0, 0, 0, 0, 1, 0);
    EXPECT_ERROR(0x27);
    SEND(0xDE, 1, 1, 0);
    EXPECT_ERROR(0x22);
    SEND(0xDE, 3, 0, 0);
    EXPECT_ERROR(0x27);
    SEND(0xDD, 3);
    EXPECT_ERROR(0x27);
    SEND(0xD7, 0, XCP_DAQ_EVENTS, 0);
    EXPECT(0xFE, 0x22);
    SEND(0xDF, 0, 1, 0);
    EXPECT_ERROR(0x22);
    SEND(0xE3, 0, 1, 0);
    EXPECT_ERROR(0x22);
}

void test_a_cleared_list_is_stopped_and_must_be_written_again(void)
{
    one_list(0, 1, 0x10);
    start();
    SEND(0xDF, 0, 0, 0);
    EXPECT(0xFF, 0x50, 0, 0, 0, 0, 1);
    SEND(0xE3, 0, 0, 0);
    EXPECT(0xFF);
    event();
    TEST_ASSERT_FALSE(next());
    SEND(0xDE, 1, 0, 0);
    EXPECT_ERROR(0x2A);
}

void test_the_slave_describes_its_lists_clock_and_events(void)
{
    SEND(0xDA);
    EXPECT(0xFF, 0x93, XCP_DAQ_LISTS, 0, XCP_DAQ_EVENTS, 0, 0, 0);
    SEND(0xD9);
    EXPECT(0xFF, 1, 7, 1, 0, 0x62, 1, 0);
    event();
    SEND(0xDC);
    EXPECT(0xFF, 0, 0, 0, 1, 0, 0, 0);
    SEND(0xD7, 0, 1, 0);
    EXPECT(0xFF, 0x04, XCP_DAQ_LISTS, 0, 10, 6, 0);
    SEND(0xD7, 0, 0, 0);
    EXPECT(0xFF, 0x04, XCP_DAQ_LISTS, 0, 1, 6, 0);
}

/* 22 periods at 22.5 kHz are 0.978 ms, reported as 98 times 10 us. */
void test_a_step_that_is_not_a_millisecond_is_reported_exactly_also_after_the_lists_were_cleared(void)
{
    slave.daq.step_10us = 98;
    event();
    xcp_daq_reset(&slave.daq);
    SEND(0xDC);
    EXPECT_WHOLE(0xFF, 0, 0, 0, 1, 0, 0, 0); /* the clock goes on */
    SEND(0xD7, 0, 0, 0);
    EXPECT(0xFF, 0x04, XCP_DAQ_LISTS, 0, 98, 4, 0);
    SEND(0xD7, 0, 1, 0);
    EXPECT(0xFF, 0x04, XCP_DAQ_LISTS, 0, 10, 6, 0);
}

/* Steps in which none, one or two milliseconds pass: event 0 samples in each step, event 1 once in ten milliseconds. */
void test_the_tenth_millisecond_is_sampled_once_for_any_length_of_the_steps(void)
{
    for (uint32_t passed = 0; passed <= 2; passed++) {
        master_reset();
        master_connect();
        one_list(1, 1, 0x10);
        start();
        uint32_t ms = 0;
        unsigned samples = 0;
        for (int n = 0; n < 90; n++) {
            const uint32_t now = (n % 2 == 0) ? passed : 1U;
            ms += now;
            xcp_daq_event(&slave.daq, &slave_config.memory, now);
            while (next()) {
                samples++;
                TEST_ASSERT_EQUAL_UINT32(ms, dto.data[1] + 256U * dto.data[2]);
                TEST_ASSERT_TRUE(ms % 10U < now);
            }
        }
        TEST_ASSERT_EQUAL_UINT32(ms / 10U, samples);
    }
}

void test_the_end_of_the_session_ends_measuring(void)
{
    one_list(0, 1, 0);
    start();
    event();
    SEND(0xFE);
    TEST_ASSERT_FALSE(next());
    event();
    TEST_ASSERT_FALSE(next());
}
