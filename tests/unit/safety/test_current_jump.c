/* SPDX-License-Identifier: Apache-2.0 */
#include "safety/current_jump.h"

#include "unity.h"

static dq_q15_t last;
static uint32_t before;

void setUp(void)
{
    last = (dq_q15_t){-6000, 8000}; /* 10000 counts long */
    before = 0;
}

void tearDown(void)
{
}

/* The size of the jump if it is one of a gain, else 0. */
static uint32_t jump_to(dq_q15_t now, dq_q15_t next)
{
    const uint32_t moved = current_jump_moved(last, now);
    return (current_jump_stands_out(moved, before) && current_jump_is_of_gain(last, now, next)) ? moved : 0U;
}

/* To the current times 1 + share, turned by a share of its length across; then moved on by this many counts in d. */
static bool found(double share, double across, int32_t on)
{
    const dq_q15_t i = {(int32_t)(-6000.0 * (1.0 + share) - 8000.0 * across),
                        (int32_t)(8000.0 * (1.0 + share) - 6000.0 * across)};
    return jump_to(i, (dq_q15_t){i.d + on, i.q}) != 0U;
}

/* Of a current along q, which stays afterwards. */
static uint32_t jump_from(int32_t q, dq_q15_t now)
{
    last = (dq_q15_t){0, q};
    return jump_to(now, now);
}

void test_a_gain_that_jumps_is_found_in_both_directions(void)
{
    static const double shares[] = {-0.45, -0.3, -0.1, -0.07, 0.07, 0.1, 0.3, 0.45};
    for (unsigned n = 0; n < sizeof shares / sizeof shares[0]; n++) {
        setUp();
        TEST_ASSERT_TRUE(found(shares[n], 0.0, 0));
    }
}

/* A sixteenth is 0.0625. A phase without its lead takes more than half of the current at once. */
void test_too_small_and_too_large_jumps_are_not_of_a_gain(void)
{
    static const double shares[] = {-0.55, -0.055, 0.0, 0.055, 0.55};
    for (unsigned n = 0; n < sizeof shares / sizeof shares[0]; n++) {
        setUp();
        TEST_ASSERT_FALSE(found(shares[n], 0.0, 0));
    }
    /* 1100 and 1300 counts of 20000, above the noise */
    TEST_ASSERT_EQUAL_UINT32(0, jump_from(20000, (dq_q15_t){0, 21100}));
    TEST_ASSERT_EQUAL_UINT32(650 * 650, jump_from(20000, (dq_q15_t){0, 21300}));
}

/* An angle that jumps turns the current. */
void test_a_jump_across_the_current_is_not_of_a_gain(void)
{
    TEST_ASSERT_TRUE(found(0.2, 0.09, 0));
    setUp();
    TEST_ASSERT_FALSE(found(0.2, 0.11, 0));
    setUp();
    TEST_ASSERT_FALSE(found(0.2, -0.11, 0));
    setUp();
    TEST_ASSERT_FALSE(found(0.0, 0.2, 0));
}

/* Current control, a voltage that is wrong in one period, or a single disturbed sample: a quarter of the jump of 2000
 * counts counts. */
void test_a_current_that_goes_on_or_turns_back_has_not_jumped(void)
{
    TEST_ASSERT_TRUE(found(-0.2, 0.0, 495));
    setUp();
    TEST_ASSERT_FALSE(found(-0.2, 0.0, 505));
    setUp();
    TEST_ASSERT_FALSE(found(-0.2, 0.0, -505));
}

/* 0.02 of full scale are 655 counts. */
void test_a_jump_within_the_noise_of_the_converters_does_not_count(void)
{
    TEST_ASSERT_EQUAL_UINT32(0, jump_from(5000, (dq_q15_t){0, 5654}));
    TEST_ASSERT_TRUE(jump_from(5000, (dq_q15_t){0, 5657}) != 0U);
}

/* Twice the largest change of the current before the jump. */
void test_a_jump_stands_out_from_what_the_current_does(void)
{
    static const struct {
        uint32_t moved; /* half the change */
        bool stands_out;
    } cases[] = {{499, true}, {501, false}};
    for (unsigned n = 0; n < sizeof cases / sizeof cases[0]; n++) {
        before = cases[n].moved * cases[n].moved;
        TEST_ASSERT_EQUAL(cases[n].stands_out, found(0.2, 0.0, 0));
    }
    TEST_ASSERT_EQUAL_UINT32(1000000, current_jump_moved(last, (dq_q15_t){-7200, 9600}));
}

/* A sixteenth and a half of the current, half of the jump across it, and a quarter of the jump afterwards, exactly. */
void test_at_its_bounds_a_jump_is_not_of_a_gain(void)
{
    TEST_ASSERT_EQUAL_UINT32(0, jump_from(20000, (dq_q15_t){0, 21250}));
    TEST_ASSERT_EQUAL_UINT32(0, jump_from(20000, (dq_q15_t){0, 30000}));
    TEST_ASSERT_EQUAL_UINT32(0, jump_from(20000, (dq_q15_t){2000, 24000}));
    TEST_ASSERT_EQUAL_UINT32(2000 * 2000, jump_from(20000, (dq_q15_t){0, 24000}));
    TEST_ASSERT_EQUAL_UINT32(0, jump_to((dq_q15_t){0, 24000}, (dq_q15_t){0, 25000}));
}

void test_every_current_is_in_range(void)
{
    for (int n = 0; n < 16; n++) {
        last = (dq_q15_t){(n & 1) ? 32767 : -32768, (n & 2) ? 32767 : -32768};
        const dq_q15_t i = {(n & 4) ? 32767 : -32768, (n & 8) ? 32767 : -32768};
        TEST_ASSERT_TRUE(current_jump_moved(last, i) <= 1U << 31);
        TEST_ASSERT_EQUAL_UINT32(0, jump_to(i, i));
    }
}
