/* SPDX-License-Identifier: Apache-2.0 */
#include <string.h>

#include "can_bus.h"
#include "unity.h"

#define MS 1000000ULL
#define BIT 2000ULL /* ns at 500 kbit/s */

static can_bus_t bus;
static can_bus_passed_t passed;

void setUp(void)
{
    can_bus_init(&bus, 500000);
}

void tearDown(void)
{
}

static can_frame_t frame(uint32_t id, uint8_t length)
{
    return (can_frame_t){.id = id, .length = length};
}

static can_frame_t extended(uint32_t id)
{
    return (can_frame_t){.id = id, .extended = true, .length = 8};
}

static void post(int node, can_frame_t f, uint64_t now_ns)
{
    TEST_ASSERT_TRUE(can_bus_post(&bus, node, &f, now_ns));
}

static void next_is(uint32_t id, uint64_t end_ns)
{
    TEST_ASSERT_TRUE(can_bus_next(&bus, 100 * MS, &passed));
    TEST_ASSERT_EQUAL_HEX32(id, passed.frame.id);
    TEST_ASSERT_EQUAL_UINT64(end_ns, passed.end_ns);
}

/* 55 + 10 n and 80 + 10 n bits: Davis, Burns, Bril, Lukkien, Controller Area Network schedulability analysis, 2007. */
void test_a_frame_is_as_long_as_its_worst_case(void)
{
    for (uint8_t n = 0; n <= 8; n++) {
        can_frame_t f = frame(1, n);
        TEST_ASSERT_EQUAL_UINT32(55U + 10U * n, can_bus_bits(&f));
        f.extended = true;
        TEST_ASSERT_EQUAL_UINT32(80U + 10U * n, can_bus_bits(&f));
    }
}

void test_a_frame_is_received_after_its_last_bit(void)
{
    post(1, frame(0x100, 8), 5 * MS);
    TEST_ASSERT_FALSE(can_bus_next(&bus, 5 * MS + 135 * BIT - 1, &passed));
    TEST_ASSERT_TRUE(can_bus_next(&bus, 5 * MS + 135 * BIT, &passed));
    TEST_ASSERT_EQUAL_UINT64(5 * MS + 135 * BIT, passed.end_ns);
    TEST_ASSERT_EQUAL_INT(1, passed.from);
}

void test_the_lowest_identifier_goes_first_but_does_not_interrupt(void)
{
    post(1, frame(0x300, 8), 0);
    post(2, frame(0x100, 8), 10);
    post(3, frame(0x200, 8), 20);
    next_is(0x300, 135 * BIT);
    next_is(0x100, 2 * 135 * BIT);
    next_is(0x200, 3 * 135 * BIT);
    TEST_ASSERT_FALSE(can_bus_next(&bus, 100 * MS, &passed));
}

void test_a_node_sends_its_own_frames_in_the_order_it_was_given_them(void)
{
    post(1, frame(0x300, 0), 0);
    post(1, frame(0x100, 0), 0);
    post(2, frame(0x200, 0), 0);
    next_is(0x200, 55 * BIT);
    next_is(0x300, 110 * BIT);
    next_is(0x100, 165 * BIT);
}

/* ISO 11898-1: with equal first 11 bits the standard frame wins; a lower base identifier wins in any format. */
void test_standard_and_extended_identifiers_are_compared_bit_by_bit(void)
{
    post(1, extended(0x100U << 18 | 5U), 0);
    post(2, frame(0x100, 8), 0);
    post(3, extended(0x0FFU << 18 | 0x3FFFFU), 0);
    post(4, extended(0x100U << 18 | 4U), 0);
    next_is(0x0FFU << 18 | 0x3FFFFU, 160 * BIT);
    next_is(0x100, 295 * BIT);
    next_is(0x100U << 18 | 4U, 455 * BIT);
    next_is(0x100U << 18 | 5U, 615 * BIT);
}

void test_a_full_queue_loses_the_frame_and_counts_it(void)
{
    const can_frame_t f = frame(1, 0);
    for (int i = 0; i < CAN_BUS_QUEUE; i++) {
        post(1, f, 0);
    }
    TEST_ASSERT_FALSE(can_bus_post(&bus, 1, &f, 0));
    TEST_ASSERT_EQUAL_UINT64(1, bus.counts.lost);
    for (int i = 0; i < CAN_BUS_MAILBOXES; i++) {
        post(CAN_BUS_ECU, f, 0);
    }
    TEST_ASSERT_FALSE(can_bus_post(&bus, CAN_BUS_ECU, &f, 0));
}

/* 100 ms at 500 kbit/s are 50,000 bits; 370 frames of 135 bits are 49,950. */
void test_the_load_is_counted_and_flagged_beyond_70_percent(void)
{
    for (int i = 0; i < 400; i++) {
        post(1, frame(0x100, 8), 0);
    }
    int frames = 0;
    while (can_bus_next(&bus, 100 * MS, &passed)) {
        frames++;
    }
    TEST_ASSERT_EQUAL_INT(370, frames);
    TEST_ASSERT_EQUAL_UINT64(1, bus.counts.windows);
    TEST_ASSERT_EQUAL_UINT64(1, bus.counts.windows_over);
    TEST_ASSERT_DOUBLE_WITHIN(1e-9, 0.999, bus.counts.load_peak);
    TEST_ASSERT_EQUAL_DOUBLE(0.0, bus.counts.own_load_peak);
}

void test_idle_windows_are_counted_as_idle(void)
{
    post(CAN_BUS_ECU, frame(0x100, 8), 50 * MS);
    TEST_ASSERT_TRUE(can_bus_next(&bus, 1000 * MS, &passed));
    TEST_ASSERT_FALSE(can_bus_next(&bus, 1000 * MS, &passed));
    TEST_ASSERT_EQUAL_UINT64(10, bus.counts.windows);
    TEST_ASSERT_EQUAL_UINT64(0, bus.counts.windows_over);
    TEST_ASSERT_EQUAL_DOUBLE(0.0, bus.counts.load);
    TEST_ASSERT_DOUBLE_WITHIN(1e-9, 135.0 / 50000.0, bus.counts.own_load_peak);
}

void test_an_ecu_that_is_switched_off_sends_nothing_more(void)
{
    post(CAN_BUS_ECU, frame(0x100, 8), 0);
    post(CAN_BUS_ECU, frame(0x101, 8), 0);
    post(1, frame(0x200, 8), 0);
    TEST_ASSERT_FALSE(can_bus_next(&bus, 10 * BIT, &passed)); /* the first frame is being transmitted */
    can_bus_silence_ecu(&bus);
    next_is(0x200, 270 * BIT);
    TEST_ASSERT_FALSE(can_bus_next(&bus, 100 * MS, &passed));
}
