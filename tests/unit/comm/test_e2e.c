/* SPDX-License-Identifier: Apache-2.0 */
#include "comm/e2e.h"
#include "unity.h"

#define DATA_ID 0x0123U

static e2e_state_t state;

void setUp(void)
{
    state = (e2e_state_t){0};
}

void tearDown(void)
{
}

static can_frame_t frame_with(uint8_t counter)
{
    can_frame_t frame = {.id = 0x110, .length = 8, .data = {0, 0, 1, 2, 3, 4, 5, 6}};
    e2e_protect(DATA_ID, &counter, &frame);
    return frame;
}

static e2e_status_t check(uint8_t counter)
{
    const can_frame_t frame = frame_with(counter);
    return e2e_check(DATA_ID, &state, &frame);
}

/* Data id 0x0123 and eight zero bytes: the remainders of 0x2301 x^64 and 0x2301 x^64 + x^56 (counter 1 in byte 1)
 * modulo x^8 + x^4 + x^3 + x^2 + 1, computed by long division outside this project. */
void test_the_crc_of_a_known_frame_is_that_of_the_specification(void)
{
    can_frame_t frame = {.length = 8};
    uint8_t counter = 0;
    e2e_protect(DATA_ID, &counter, &frame);
    TEST_ASSERT_EQUAL_HEX8(0xCC, frame.data[0]);
    e2e_protect(DATA_ID, &counter, &frame);
    TEST_ASSERT_EQUAL_HEX8(0x91, frame.data[0]);
    TEST_ASSERT_EQUAL_HEX8(0x01, frame.data[1]);
}

void test_the_counter_runs_from_0_to_14_and_leaves_the_other_nibble_alone(void)
{
    can_frame_t frame = {.length = 8, .data = {0, 0xA0}};
    uint8_t counter = 0;
    for (unsigned n = 0; n < 31; n++) {
        e2e_protect(DATA_ID, &counter, &frame);
        TEST_ASSERT_EQUAL_HEX8(0xA0U | n % 15U, frame.data[1]);
    }
}

void test_the_first_frame_only_synchronises_the_counter(void)
{
    TEST_ASSERT_EQUAL_INT(E2E_FIRST, check(7));
    TEST_ASSERT_EQUAL_INT(E2E_OK, check(8));
}

/* From every counter to every other: 1 ahead is right, 2 ahead is one lost frame, 0 a repetition, the rest a jump. */
void test_every_step_of_the_counter_is_checked_by_how_far_it_is_ahead(void)
{
    for (uint8_t from = 0; from < 15; from++) {
        for (uint8_t ahead = 0; ahead < 15; ahead++) {
            state = (e2e_state_t){0};
            (void)check(from);
            const uint8_t to = (uint8_t)((from + ahead) % 15);
            const e2e_status_t wanted = (ahead == 0)   ? E2E_REPEATED
                                        : (ahead == 1) ? E2E_OK
                                        : (ahead == 2) ? E2E_SKIPPED
                                                       : E2E_JUMP;
            TEST_ASSERT_EQUAL_INT(wanted, check(to));
            /* The next frame is compared with the new counter. */
            TEST_ASSERT_EQUAL_INT(E2E_OK, check((uint8_t)((to + 1) % 15)));
        }
    }
}

void test_counter_15_is_refused_and_does_not_advance_the_counter(void)
{
    can_frame_t frame = frame_with(3);
    TEST_ASSERT_EQUAL_INT(E2E_FIRST, e2e_check(DATA_ID, &state, &frame));
    frame.data[1] |= 0x0FU;
    frame.data[0] = e2e_crc(DATA_ID, &frame);
    TEST_ASSERT_EQUAL_INT(E2E_JUMP, e2e_check(DATA_ID, &state, &frame));
    TEST_ASSERT_EQUAL_INT(E2E_OK, check(4));
}

void test_a_wrong_crc_does_not_advance_the_counter(void)
{
    (void)check(3);
    for (unsigned bit = 0; bit < 64; bit++) {
        can_frame_t frame = frame_with(4);
        frame.data[bit / 8U] = (uint8_t)(frame.data[bit / 8U] ^ 1U << bit % 8U);
        TEST_ASSERT_EQUAL_INT(E2E_CRC, e2e_check(DATA_ID, &state, &frame));
    }
    TEST_ASSERT_EQUAL_INT(E2E_OK, check(4));
}

void test_another_data_id_is_a_wrong_crc(void)
{
    const can_frame_t frame = frame_with(3);
    TEST_ASSERT_EQUAL_INT(E2E_CRC, e2e_check(DATA_ID + 1U, &state, &frame));
    TEST_ASSERT_EQUAL_INT(E2E_CRC, e2e_check(DATA_ID + 256U, &state, &frame));
}

void test_any_other_length_is_refused_before_the_data_are_checked(void)
{
    for (uint8_t length = 0; length < 8; length++) {
        can_frame_t frame = frame_with(3);
        frame.length = length;
        TEST_ASSERT_EQUAL_INT(E2E_WRONG_LENGTH, e2e_check(DATA_ID, &state, &frame));
    }
    TEST_ASSERT_FALSE(state.synced);
}

/* The division by x^8 + x^4 + x^3 + x^2 + 1, bit by bit. */
static uint8_t remainder_of_byte(uint8_t byte)
{
    unsigned rest = byte;
    for (int bit = 0; bit < 8; bit++) {
        rest = ((rest & 0x80U) != 0U) ? (rest << 1 ^ 0x1DU) & 0xFFU : rest << 1;
    }
    return (uint8_t)rest;
}

/* Only the last byte of the frame is not zero, so that the CRC is the remainder of this byte. */
void test_the_remainder_of_each_byte_is_that_of_the_polynomial(void)
{
    for (unsigned byte = 0; byte < 256; byte++) {
        const can_frame_t frame = {.length = 8, .data = {[7] = (uint8_t)byte}};
        TEST_ASSERT_EQUAL_HEX8(remainder_of_byte((uint8_t)byte), e2e_crc(0, &frame));
    }
}
