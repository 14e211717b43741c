/* SPDX-License-Identifier: Apache-2.0 */
#include "safety/shorted_switch.h"

#include <math.h>
#include <stdbool.h>
#include <stdlib.h>

#include "unity.h"

#define TURN 6.283185307179586
#define I_MIN 200
#define V_DC 22938 /* 0.7 of V_b */
#define PERIOD 0.33 /* omega_b T_s */
#define GAIN ((int32_t)(TURN / PERIOD * 32768.0))
#define MOST 8000

/* The inputs of these terminals (0: lower rail, 1: upper rail) and phase currents. */
static shorted_switch_in_t inputs(const double terminal[3], const int last[3], const int now[3])
{
    const double per_dc = V_DC * PERIOD, mean = (terminal[0] + terminal[1] + terminal[2]) / 3.0;
    const double beta = (terminal[1] - terminal[2]) / sqrt(3.0);
    return (shorted_switch_in_t){
        .i_last = {last[0], last[1], last[2]},
        .i = {now[0], now[1], now[2]},
        .psi_last = fx_pair(1234, -4321),
        .psi = fx_pair(1234 + (int32_t)lround((terminal[0] - mean) * per_dc), -4321 + (int32_t)lround(beta * per_dc)),
        .v_dc = V_DC,
        .turn_gain = GAIN,
        .i_min = I_MIN,
    };
}

static shorted_switch_t find(const double terminal[3], const int last[3], const int now[3])
{
    const shorted_switch_in_t in = inputs(terminal, last, now);
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

/* The lower switch of c is shorted, and the current of b dies against the upper rail within a quarter of the period or
 * less: a straight line from -1250 to 250 would say five sixths. */
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

/* (SS-28) in double precision, with these mean directions; per v_dc. *clear: at most the distance to the second one. */
static int largest_in_double(const double terminal[3], const double g[3], double *r, double *clear)
{
    const double mean = (terminal[0] + terminal[1] + terminal[2]) / 3.0, sum = g[0] + g[1] + g[2];
    double size[3];
    int largest = 0;
    for (int x = 0; x < 3; x++) {
        const double one = terminal[x] - mean + 0.5 * (g[x] - sum / 3.0);
        size[x] = fabs(one);
        if (x == 0 || size[x] > size[largest]) {
            *r = one;
            largest = x;
        }
    }
    for (int x = 0; x < 3; x++) {
        *clear = (x == largest) ? *clear : fmin(*clear, size[largest] - size[x]);
    }
    return largest;
}

/* (SS-29) in double precision. *clear: the distance to another decision. */
static shorted_switch_t found_in_double(const double terminal[3], const int last[3], const int now[3], double *clear)
{
    double g[3], r;
    int known = 0;
    bool turned[3];
    *clear = 1.0;
    for (int x = 0; x < 3; x++) {
        const int size = abs(now[x]), size_last = abs(last[x]);
        turned[x] = size > I_MIN && size_last > I_MIN && (last[x] < 0) != (now[x] < 0);
        g[x] = turned[x] ? (double)(last[x] + now[x]) / (size_last + size) : (now[x] > 0) ? 1.0 : -1.0;
        g[x] = (size > I_MIN) ? g[x] : 0.0;
        known += (size > I_MIN) ? 1 : 0;
    }
    int x = largest_in_double(terminal, g, &r, clear);
    if (!turned[x]) {
        for (int y = 0; y < 3; y++) {
            g[y] = turned[y] ? 0.0 : g[y];
            known -= turned[y] ? 1 : 0;
        }
        x = largest_in_double(terminal, g, &r, clear);
    }
    const double above = fabs(r) - ((known == 3) ? 1.0 / 8.0 : 25.0 / 48.0);
    *clear = fmin(*clear, fabs(above));
    if (known < 2 || above <= 0.0 || abs(now[x]) <= I_MIN || (r > 0.0) != (now[x] > 0)) {
        return SHORTED_SWITCH_NONE;
    }
    return (r > 0.0) ? SHORTED_SWITCH_UPPER : SHORTED_SWITCH_LOWER;
}

static int draw(uint32_t *seed, int from, int to)
{
    *seed = *seed * 1664525U + 1013904223U;
    return from + (int)((*seed >> 8) % (uint32_t)(to - from + 1));
}

/* Terminals that no bridge has, too: a flux that is wrong. Left out is what rounding decides. */
void test_the_fixed_point_decides_as_double_precision_does(void)
{
    uint32_t seed = 7;
    int compared = 0, counts[3] = {0};
    for (int n = 0; n < 100000; n++) {
        double terminal[3], clear;
        int last[3], now[3];
        for (int x = 0; x < 3; x++) {
            const int scale = draw(&seed, 0, 2) == 0 ? 2 * I_MIN : MOST;
            terminal[x] = 0.01 * draw(&seed, -50, 150);
            last[x] = draw(&seed, -scale, scale);
            now[x] = draw(&seed, -scale, scale);
        }
        const shorted_switch_t expected = found_in_double(terminal, last, now, &clear);
        if (clear > 1e-3) {
            TEST_ASSERT_EQUAL(expected, find(terminal, last, now));
            compared++;
            counts[expected]++;
        }
    }
    TEST_ASSERT_TRUE(compared > 95000 && counts[SHORTED_SWITCH_LOWER] > 5000 && counts[SHORTED_SWITCH_UPPER] > 5000);
}

/* A phase exactly at i_min, with a flux that would show it. */
void test_a_phase_without_direction_is_never_the_shorted_one(void)
{
    for (int sign = -1; sign <= 1; sign += 2) {
        const double beyond[3] = {0.5 + 1.5 * sign, 0.5, 0.5};
        const int i[3] = {sign * I_MIN, MOST, -MOST};
        TEST_ASSERT_EQUAL(SHORTED_SWITCH_NONE, find_steady(beyond, i));
        const int more[3] = {sign * (I_MIN + 1), MOST, -MOST};
        TEST_ASSERT_EQUAL((sign > 0) ? SHORTED_SWITCH_UPPER : SHORTED_SWITCH_LOWER, find_steady(beyond, more));
    }
}

/* The bound is zero, and so is every r. */
void test_without_a_dc_voltage_nothing_is_found(void)
{
    for (int sign = -1; sign <= 1; sign += 2) {
        const int i[3] = {sign * MOST, -sign * MOST / 2, -sign * MOST / 2};
        shorted_switch_in_t in = inputs((const double[]){0.0, 0.0, 0.0}, i, i);
        in.v_dc = 0;
        TEST_ASSERT_EQUAL(SHORTED_SWITCH_NONE, shorted_switch_find(&in));
    }
}

/* Without a dc voltage r is the voltage alone: 2000 and -2000, exactly. */
void test_of_two_phases_with_the_same_magnitude_the_first_one_counts(void)
{
    const shorted_switch_in_t in = {
        .i_last = {MOST, -MOST, 0},
        .i = {MOST, -MOST, 0},
        .psi = fx_pair(2000, -1155),
        .turn_gain = 1 << 20,
        .i_min = I_MIN,
    };
    TEST_ASSERT_EQUAL(SHORTED_SWITCH_UPPER, shorted_switch_find(&in));
}
