/* SPDX-License-Identifier: Apache-2.0 */
#include "safety/short_side.h"

#include <math.h>

#include "unity.h"

#define I_MIN 1000
#define TURN 6.283185307179586

static short_side_state_t state;

void setUp(void)
{
    state = (short_side_state_t){0};
}

void tearDown(void)
{
}

/* Phase currents of this amplitude whose phase x (0 ... 2) loses the half wave of one sign; the others share it. */
static abc_q15_t currents(double amplitude, double angle, int x, int lost_sign)
{
    double i[3];
    for (int k = 0; k < 3; k++) {
        i[k] = amplitude * cos(angle - k * TURN / 3.0);
    }
    const double lost = (lost_sign * i[x] > 0.0) ? i[x] : 0.0;
    for (int k = 0; k < 3; k++) {
        i[k] += (k == x) ? -lost : 0.5 * lost;
    }
    return (abc_q15_t){(int32_t)i[0], (int32_t)i[1], (int32_t)i[2]};
}

static bool turns(double turn_per_step, int x, int lost_sign)
{
    bool upper = false;
    for (int n = 0; n < 100; n++) {
        const double angle = n * turn_per_step * TURN;
        const short_side_in_t in = {
            .acting = true,
            .i = currents(10000.0, angle, x, lost_sign),
            .i_ref = currents(10000.0, angle, x, 0),
        };
        short_side_step(&state, &in);
        upper = short_side_is_upper(&state, I_MIN);
    }
    return upper;
}

/* A lower switch conducts the current into the bridge, the negative half wave; an upper one the positive. A third of
 * the amplitude is constant then. */
void test_the_side_whose_switches_all_conduct_is_chosen(void)
{
    static const double turn[] = {0.13, 0.21, 0.37, 0.51};
    for (int n = 0; n < 4; n++) {
        for (int x = 0; x < 3; x++) {
            setUp();
            TEST_ASSERT_TRUE(turns(turn[n], x, -1));
            setUp();
            TEST_ASSERT_FALSE(turns(turn[n], x, 1));
        }
    }
}

void test_a_sound_bridge_is_shorted_by_the_lower_switches(void)
{
    TEST_ASSERT_FALSE(turns(0.2, 0, 0));
    TEST_ASSERT_FALSE(short_side_is_upper(&(short_side_state_t){0}, 0));
}

/* 32 samples from 0 to 1 - 1/e of the constant current; beyond i_min it decides, whichever phase it is in. */
void test_a_constant_current_counts_from_i_min_on(void)
{
    for (int x = 0; x < 3; x++) {
        setUp();
        abc_q15_t i = {-600, -600, -600};
        *(x == 0 ? &i.a : x == 1 ? &i.b : &i.c) = 1200;
        const short_side_in_t in = {.acting = true, .i = i};
        for (int n = 0; n < 56; n++) { /* 1200 (1 - (31/32)^56) = 997 */
            short_side_step(&state, &in);
            TEST_ASSERT_FALSE(short_side_is_upper(&state, I_MIN));
        }
        short_side_step(&state, &in);
        TEST_ASSERT_TRUE(short_side_is_upper(&state, I_MIN)); /* 1003 */
    }
}

/* The currents of a short circuit have a constant part of either sign, which decays. */
void test_the_short_circuit_keeps_the_side_and_switching_disabled_clears_it(void)
{
    short_side_in_t in = {.shorted = true, .i = {20000, -10000, -10000}};
    for (int n = 0; n < 100; n++) {
        short_side_step(&state, &in);
    }
    TEST_ASSERT_FALSE(short_side_is_upper(&state, I_MIN));
    TEST_ASSERT_TRUE(turns(0.21, 1, -1));
    in.i = (abc_q15_t){-20000, 10000, 10000};
    for (int n = 0; n < 100; n++) {
        short_side_step(&state, &in);
        TEST_ASSERT_TRUE(short_side_is_upper(&state, I_MIN));
    }
    in.shorted = false;
    short_side_step(&state, &in);
    TEST_ASSERT_FALSE(short_side_is_upper(&state, I_MIN));
    TEST_ASSERT_EQUAL_INT32(0, state.a_q8);
    TEST_ASSERT_EQUAL_INT32(0, state.b_q8);
}

/* A 32nd of the difference, in 1/256 of a count. */
void test_the_mean_is_of_the_current_beyond_its_reference(void)
{
    const short_side_in_t in = {.acting = true, .i = {1600, -800, -800}, .i_ref = {320, 160, -480}};
    short_side_step(&state, &in);
    TEST_ASSERT_EQUAL_INT32(1280 * 256 / 32, state.a_q8);
    TEST_ASSERT_EQUAL_INT32(-960 * 256 / 32, state.b_q8);
}

void test_just_i_min_or_as_much_of_either_sign_decides_for_the_lower_side(void)
{
    for (int beyond = 0; beyond <= 1; beyond++) {
        const short_side_state_t least = {.a_q8 = I_MIN * 256 + beyond, .b_q8 = -I_MIN * 128};
        TEST_ASSERT_EQUAL(beyond == 1, short_side_is_upper(&least, I_MIN));
        const short_side_state_t uneven = {.a_q8 = 2000 * 256, .b_q8 = -2000 * 256 + beyond};
        TEST_ASSERT_EQUAL(beyond == 1, short_side_is_upper(&uneven, I_MIN));
    }
}
