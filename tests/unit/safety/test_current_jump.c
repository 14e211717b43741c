/* SPDX-License-Identifier: Apache-2.0 */
#include "safety/current_jump.h"

#include "unity.h"

static current_jump_t jump;

void setUp(void)
{
    jump = (current_jump_t){.last = {-6000, 8000}}; /* 10000 counts long */
}

void tearDown(void)
{
}

/* To the current times 1 + share, turned by a share of its length across; then moved on by this many counts in d. */
static bool found(double share, double across, int32_t on)
{
    const dq_q15_t i = {(int32_t)(-6000.0 * (1.0 + share) - 8000.0 * across),
                        (int32_t)(8000.0 * (1.0 + share) - 6000.0 * across)};
    current_jump_step(&jump, i);
    return jump.jump != 0U && current_jump_stays(&jump, (dq_q15_t){i.d + on, i.q});
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
    jump = (current_jump_t){.last = {0, 20000}}; /* 1100 and 1300 counts, above the noise */
    current_jump_step(&jump, (dq_q15_t){0, 21100});
    TEST_ASSERT_EQUAL_UINT32(0, jump.jump);
    jump = (current_jump_t){.last = {0, 20000}};
    current_jump_step(&jump, (dq_q15_t){0, 21300});
    TEST_ASSERT_EQUAL_UINT32(650 * 650, jump.jump);
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
    jump.last = (dq_q15_t){0, 5000};
    current_jump_step(&jump, (dq_q15_t){0, 5654});
    TEST_ASSERT_EQUAL_UINT32(0, jump.jump);
    jump.last = (dq_q15_t){0, 5000};
    jump.largest = 0;
    current_jump_step(&jump, (dq_q15_t){0, 5657});
    TEST_ASSERT_TRUE(jump.jump != 0U);
}

/* Twice the largest change of the current in this step before the jump, and in the step before it. */
void test_a_jump_stands_out_from_what_the_current_does(void)
{
    static const struct {
        uint32_t moved; /* half the change */
        bool stands_out;
    } cases[] = {{499, true}, {501, false}};
    for (unsigned n = 0; n < sizeof cases / sizeof cases[0]; n++) {
        setUp();
        jump.before = cases[n].moved * cases[n].moved;
        TEST_ASSERT_EQUAL(cases[n].stands_out, found(0.2, 0.0, 0));
        setUp();
        jump.largest = cases[n].moved * cases[n].moved;
        TEST_ASSERT_EQUAL(cases[n].stands_out, found(0.2, 0.0, 0));
    }
    TEST_ASSERT_EQUAL_UINT32(1000000, jump.largest);
}

static uint32_t jump_to(int32_t d, int32_t q)
{
    jump = (current_jump_t){.last = {0, 20000}};
    current_jump_step(&jump, (dq_q15_t){d, q});
    return jump.jump;
}

/* A sixteenth and a half of the current, half of the jump across it, and a quarter of the jump afterwards, exactly. */
void test_at_its_bounds_a_jump_is_not_of_a_gain(void)
{
    TEST_ASSERT_EQUAL_UINT32(0, jump_to(0, 21250));
    TEST_ASSERT_EQUAL_UINT32(0, jump_to(0, 30000));
    TEST_ASSERT_EQUAL_UINT32(0, jump_to(2000, 24000));
    TEST_ASSERT_EQUAL_UINT32(2000 * 2000, jump_to(0, 24000));
    TEST_ASSERT_FALSE(current_jump_stays(&jump, (dq_q15_t){0, 25000}));
    current_jump_step(&jump, (dq_q15_t){0, 24100});
    TEST_ASSERT_EQUAL_UINT32(2000 * 2000, jump.largest);
}

void test_every_current_is_in_range(void)
{
    for (int n = 0; n < 16; n++) {
        jump.last = (dq_q15_t){(n & 1) ? 32767 : -32768, (n & 2) ? 32767 : -32768};
        jump.largest = 0;
        const dq_q15_t i = {(n & 4) ? 32767 : -32768, (n & 8) ? 32767 : -32768};
        current_jump_step(&jump, i);
        TEST_ASSERT_TRUE(jump.largest <= 1U << 31);
        TEST_ASSERT_EQUAL_UINT32(0, jump.jump);
    }
}
