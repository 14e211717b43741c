/* SPDX-License-Identifier: Apache-2.0 */
#include "safety/shorted_switch.h"

#include <math.h>

#include "unity.h"

#define TURN 6.283185307179586
#define I_MIN 200
#define V_DC 22938 /* 0.7 of V_b */
#define PERIOD 0.33 /* omega_b T_s */
#define GAIN ((int32_t)(TURN / PERIOD * 32768.0))
#define MOST 8000

/* What is expected of these terminals (0: lower rail, 1: upper rail) and phase currents. */
static shorted_switch_t find(const double terminal[3], const int last[3], const int now[3])
{
    const double per_dc = V_DC * PERIOD, mean = (terminal[0] + terminal[1] + terminal[2]) / 3.0;
    const double beta = (terminal[1] - terminal[2]) / sqrt(3.0);
    const shorted_switch_in_t in = {
        .i_last = {last[0], last[1], last[2]},
        .i = {now[0], now[1], now[2]},
        .psi_last = fx_pair(1234, -4321),
        .psi = fx_pair(1234 + (int32_t)lround((terminal[0] - mean) * per_dc), -4321 + (int32_t)lround(beta * per_dc)),
        .v_dc = V_DC,
        .turn_gain = GAIN,
        .i_min = I_MIN,
    };
    return shorted_switch_find(&in);
}

static shorted_switch_t find_steady(const double terminal[3], const int i[3])
{
    return find(terminal, i, i);
}

/* The rail to which the diodes of an intact bridge connect a phase. */
static double of_diodes(int i)
{
    return (i > 0) ? 0.0 : 1.0;
}

void setUp(void)
{
}

void tearDown(void)
{
}

/* All directions of three currents, and each of the six switches. A switch that carries no current against its diode
 * changes nothing. */
void test_a_switch_that_conducts_against_its_diode_is_found_in_every_phase(void)
{
    for (int signs = 1; signs < 7; signs++) {
        int i[3];
        double intact[3];
        for (int x = 0; x < 3; x++) {
            i[x] = ((signs >> x) & 1) ? MOST : -MOST / 2;
            intact[x] = of_diodes(i[x]);
        }
        TEST_ASSERT_EQUAL(SHORTED_SWITCH_NONE, find_steady(intact, i));
        for (int x = 0; x < 3; x++) {
            double shorted[3] = {intact[0], intact[1], intact[2]};
            shorted[x] = 1.0 - intact[x];
            TEST_ASSERT_EQUAL((i[x] > 0) ? SHORTED_SWITCH_UPPER : SHORTED_SWITCH_LOWER, find_steady(shorted, i));
        }
    }
}

/* A phase without current may have any voltage between the rails. Where it is at the rail of the other two, the side of
 * that rail cannot be known. */
void test_a_third_phase_without_current_decides_the_rail_of_the_other_two(void)
{
    for (int k = 0; k <= 100; k++) {
        const double third = 0.01 * k;
        for (int x = 0; x < 3; x++) {
            const int y = (x + 1) % 3, z = (x + 2) % 3;
            int i[3];
            double intact[3], upper[3], lower[3];
            i[x] = MOST;
            i[y] = -MOST;
            i[z] = 0;
            intact[x] = lower[x] = lower[y] = 0.0;
            intact[y] = upper[x] = upper[y] = 1.0;
            intact[z] = upper[z] = lower[z] = third;
            TEST_ASSERT_EQUAL(SHORTED_SWITCH_NONE, find_steady(intact, i));
            /* (SS-29): 2/3 - (third - 1/2)/3 > 25/48 at third < 0.9375 */
            TEST_ASSERT_EQUAL((k <= 93) ? SHORTED_SWITCH_UPPER : SHORTED_SWITCH_NONE, find_steady(upper, i));
            TEST_ASSERT_EQUAL((k >= 7) ? SHORTED_SWITCH_LOWER : SHORTED_SWITCH_NONE, find_steady(lower, i));
        }
    }
}

/* A current that turns around in the middle of the period has been carried by both diodes, in an intact bridge the new
 * one for at least the share that a straight line gives: its slope is smaller against the voltage of that diode. */
void test_a_current_that_turns_around_is_carried_by_both_diodes(void)
{
    const int last[3] = {MOST, -2900, 2900 - MOST}, now[3] = {MOST, 1600, -1600 - MOST};
    TEST_ASSERT_EQUAL(SHORTED_SWITCH_UPPER, find((const double[]){0.0, 1.0, 1.0}, last, now));
    const double before = 29.0 / 45.0; /* share of the old direction, by a straight line */
    for (int k = 0; k <= 10; k++) {
        TEST_ASSERT_EQUAL(SHORTED_SWITCH_NONE, find((const double[]){0.0, 0.1 * k * before, 1.0}, last, now));
    }
}

/* The lower switch of c is shorted, and the current of b dies against the upper rail: for the tenth of the period that
 * this takes, and not for as long as a straight line from -25 to 2 would say. */
void test_a_current_that_turns_around_in_another_phase_is_not_taken_for_a_straight_line(void)
{
    const int last[3] = {7000, -1250, -5750}, now[3] = {6350, 250, -6600};
    TEST_ASSERT_EQUAL(SHORTED_SWITCH_LOWER, find((const double[]){0.0, 0.26, 0.0}, last, now));
    TEST_ASSERT_EQUAL(SHORTED_SWITCH_NONE, find((const double[]){0.0, 0.05, 0.0}, last, now));
    TEST_ASSERT_EQUAL(SHORTED_SWITCH_NONE, find((const double[]){0.0, 0.1, 1.0}, last, now)); /* intact */
}

/* 3/16 of the rails' distance is 1/8 in r; two thirds of what a phase differs remain, because the star point moves. */
void test_with_three_known_directions_an_eighth_of_the_dc_voltage_is_enough(void)
{
    const int last[3] = {MOST, -1000, 1000 - MOST}, now[3] = {MOST, 1000, -1000 - MOST};
    TEST_ASSERT_EQUAL(SHORTED_SWITCH_NONE, find((const double[]){0.0, 0.5 + 0.183, 1.0}, last, now));
    TEST_ASSERT_EQUAL(SHORTED_SWITCH_UPPER, find((const double[]){0.0, 0.5 + 0.192, 1.0}, last, now));
    TEST_ASSERT_EQUAL(SHORTED_SWITCH_NONE, find((const double[]){0.0, 0.5 - 0.192, 1.0}, last, now));
}

/* A current that ends at I_MIN has no direction, one that begins there has that of its end. */
void test_a_current_that_is_too_small_at_the_end_has_no_direction(void)
{
    const double two_upper[3] = {1.0, 1.0, 0.2};
    TEST_ASSERT_EQUAL(SHORTED_SWITCH_UPPER,
                      find(two_upper, (const int[]){-I_MIN, I_MIN, 0}, (const int[]){I_MIN + 1, -I_MIN - 1, 0}));
    TEST_ASSERT_EQUAL(SHORTED_SWITCH_NONE,
                      find(two_upper, (const int[]){MOST, -MOST, 0}, (const int[]){I_MIN, -MOST, 0}));
    TEST_ASSERT_EQUAL(SHORTED_SWITCH_NONE,
                      find(two_upper, (const int[]){MOST, -MOST, 0}, (const int[]){MOST, -I_MIN, 0}));
}

/* No current: every phase has the back-EMF of its magnet, whatever that is. */
void test_without_current_nothing_is_found(void)
{
    const int none[3] = {0, 0, 0}, one[3] = {MOST, 0, 0};
    for (int k = 0; k < 12; k++) {
        double emf[3];
        for (int x = 0; x < 3; x++) {
            emf[x] = 0.5 + 0.58 * cos((k / 12.0 - x / 3.0) * TURN);
        }
        TEST_ASSERT_EQUAL(SHORTED_SWITCH_NONE, find_steady(emf, none));
        TEST_ASSERT_EQUAL(SHORTED_SWITCH_NONE, find_steady(emf, one));
    }
}
