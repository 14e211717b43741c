/* SPDX-License-Identifier: Apache-2.0 */
#include "safety/open_switch.h"

#include <math.h>

#include "unity.h"

#define TURN 6.283185307179586
#define I_MIN 200
#define I_MAX 20000
#define PSI_MIN 8000
#define SMALL (100 * 100) /* square of a small current */

static const open_switch_config_t config = {.i_min = I_MIN, .i_max = I_MAX, .psi_min = PSI_MIN};
static open_switch_state_t state;

void setUp(void)
{
    state = (open_switch_state_t){0};
}

void tearDown(void)
{
}

static uint32_t q16_of(double turns)
{
    return (uint32_t)lround(turns * 65536.0);
}

/* Phase currents around a constant part in phase x. The vector's magnitude is that of both parts. */
static open_switch_in_t sample(double turns_at, double amplitude, int x, double constant, bool upper)
{
    double i[3];
    for (int k = 0; k < 3; k++) {
        i[k] = amplitude * cos((turns_at - k / 3.0) * TURN) + ((k == x) ? constant : -0.5 * constant);
    }
    const double alpha = i[0], beta = (i[1] - i[2]) / sqrt(3.0);
    return (open_switch_in_t){.i = {(int32_t)lround(i[0]), (int32_t)lround(i[1]), (int32_t)lround(i[2])},
                              .i_squared_q30 = (int32_t)lround(alpha * alpha + beta * beta),
                              .upper = upper};
}

/* Periods until something is found; at most two turns. */
static int periods_until_found(double turns_per_period, double amplitude, int x, double constant, bool upper,
                               open_switch_t *found)
{
    const int most = (int)(2.0 / fabs(turns_per_period));
    for (int n = 1; n <= most; n++) {
        open_switch_in_t in = sample(n * turns_per_period, amplitude, x, constant, upper);
        in.step_q16 = q16_of(fabs(turns_per_period));
        *found = open_switch_by_currents(&config, &state, &in);
        if (*found != OPEN_SWITCH_NONE) {
            return n;
        }
    }
    return 0;
}

/* 20 periods of a twentieth of a turn, in either direction of rotation, after the first that counts. */
void test_a_phase_that_conducts_in_one_direction_for_a_turn_lacks_its_switch(void)
{
    for (int x = 0; x < 3; x++) {
        for (int sign = -1; sign <= 1; sign += 2) {
            open_switch_t found;
            setUp();
            const int lower = periods_until_found(sign * 0.05, 5000.0, x, 6000.0, false, &found);
            TEST_ASSERT_INT_WITHIN(1, 20, lower);
            TEST_ASSERT_EQUAL(OPEN_SWITCH_LOWER, found);
            setUp();
            const int upper = periods_until_found(sign * 0.05, 5000.0, x, -6000.0, true, &found);
            TEST_ASSERT_INT_WITHIN(1, 20, upper);
            TEST_ASSERT_EQUAL(OPEN_SWITCH_UPPER, found);
        }
    }
}

/* The diode of an open lower switch cannot carry a current into the bridge. */
void test_a_constant_current_that_the_diode_would_block_is_no_open_switch(void)
{
    open_switch_t found;
    TEST_ASSERT_EQUAL_INT(0, periods_until_found(0.05, 5000.0, 0, -6000.0, false, &found));
    setUp();
    TEST_ASSERT_EQUAL_INT(0, periods_until_found(0.05, 5000.0, 0, 6000.0, true, &found));
}

/* 5000 cos + 4700: down to -300, beyond i_min = 200; 5000 cos + 4900: down to -100 only. */
void test_a_current_above_i_min_in_the_blocked_direction_begins_the_turn_anew(void)
{
    open_switch_t found;
    TEST_ASSERT_EQUAL_INT(0, periods_until_found(0.05, 5000.0, 1, 4700.0, false, &found));
    setUp();
    TEST_ASSERT_NOT_EQUAL_INT(0, periods_until_found(0.05, 5000.0, 1, 4900.0, false, &found));
}

/* 150 cos + 160 has a magnitude of 310 at most, 1000 cos + 1100 of 100 at least, but only for a moment. */
void test_currents_below_twice_i_min_are_not_counted(void)
{
    open_switch_t found;
    TEST_ASSERT_EQUAL_INT(0, periods_until_found(0.05, 150.0, 2, 160.0, false, &found));
    TEST_ASSERT_EQUAL_UINT16(0, state.one_sided_q16[2]);
    setUp();
    TEST_ASSERT_NOT_EQUAL_INT(0, periods_until_found(0.05, 1000.0, 2, 1100.0, false, &found));
}

/* A sample whose currents are not plausible changes nothing. */
void test_currents_that_are_not_plausible_are_not_counted(void)
{
    open_switch_in_t in = {.i = {5000, -2500, -2500}, .i_squared_q30 = 5000 * 5000, .step_q16 = q16_of(0.05)};
    for (int n = 0; n < 30; n++) {
        in.i_squared_q30 = (n % 2 == 0) ? 5000 * 5000 : OPEN_SWITCH_NOT_PLAUSIBLE;
        TEST_ASSERT_EQUAL(OPEN_SWITCH_NONE, open_switch_by_currents(&config, &state, &in));
    }
    TEST_ASSERT_UINT16_WITHIN(15, 15 * q16_of(0.05), state.one_sided_q16[0]);
}

static open_switch_t with_flux(double alpha, double beta, int32_t i_squared_q30)
{
    const ab_q15_t psi = {(int32_t)lround(alpha), (int32_t)lround(beta)};
    return open_switch_by_flux(&config, &state, psi, i_squared_q30, q16_of(0.05));
}

/* The voltage of the phase without its switch adds flux in the direction of this phase. */
void test_flux_that_has_been_added_shows_the_side_of_the_open_switch(void)
{
    for (int x = 0; x < 3; x++) {
        for (int sign = -1; sign <= 1; sign += 2) {
            setUp();
            const double c = sign * cos(x * TURN / 3.0), s = sign * sin(x * TURN / 3.0);
            TEST_ASSERT_EQUAL(OPEN_SWITCH_NONE, with_flux(12000.0, -9000.0, SMALL));
            TEST_ASSERT_EQUAL(OPEN_SWITCH_NONE, with_flux(12000.0 + 4000 * c, -9000.0 + 4000 * s, SMALL));
            TEST_ASSERT_EQUAL(OPEN_SWITCH_NONE, with_flux(12000.0 + 7990 * c, -9000.0 + 7990 * s, SMALL));
            TEST_ASSERT_EQUAL((sign > 0) ? OPEN_SWITCH_LOWER : OPEN_SWITCH_UPPER,
                              with_flux(12000.0 + 8010 * c, -9000.0 + 8010 * s, SMALL));
        }
    }
}

/* Beyond i_max the tables do not have the flux: the next sample within it is the first of another sum. */
void test_the_sum_begins_anew_after_a_current_beyond_i_max(void)
{
    (void)with_flux(0.0, 0.0, I_MAX * I_MAX);
    TEST_ASSERT_EQUAL(OPEN_SWITCH_LOWER, with_flux(8001.0, 0.0, I_MAX * I_MAX));
    setUp();
    (void)with_flux(0.0, 0.0, SMALL);
    (void)with_flux(5000.0, 0.0, SMALL);
    TEST_ASSERT_EQUAL(OPEN_SWITCH_NONE, with_flux(9000.0, 0.0, I_MAX * I_MAX + 1));
    TEST_ASSERT_EQUAL(OPEN_SWITCH_NONE, with_flux(14000.0, 0.0, SMALL));
    TEST_ASSERT_EQUAL(OPEN_SWITCH_NONE, with_flux(22000.0, 0.0, SMALL));
    TEST_ASSERT_EQUAL(OPEN_SWITCH_LOWER, with_flux(22001.0, 0.0, SMALL));
    setUp();
    (void)with_flux(0.0, 0.0, SMALL);
    TEST_ASSERT_EQUAL(OPEN_SWITCH_NONE, with_flux(9000.0, 0.0, OPEN_SWITCH_NOT_PLAUSIBLE));
    TEST_ASSERT_EQUAL(OPEN_SWITCH_NONE, with_flux(9000.0, 0.0, SMALL));
}

/* The resistance changes the flux of a complete short circuit slowly. A turn has 20 samples: 20 * 150 is below psi_min,
 * and 18 * 450 above it. */
void test_the_sum_begins_anew_after_a_turn(void)
{
    for (int n = 0; n < 200; n++) {
        TEST_ASSERT_EQUAL(OPEN_SWITCH_NONE, with_flux(20000.0 - 150.0 * n, 0.0, SMALL));
    }
    setUp();
    int n = 0;
    while (n < 100 && with_flux(30000.0 - 450.0 * n, 0.0, SMALL) == OPEN_SWITCH_NONE) {
        n++;
    }
    TEST_ASSERT_EQUAL_INT(18, n);
}

/* The bounds themselves: 2 i_min counts, and so does i_min in the direction that the diode blocks. */
void test_the_bounds_of_a_current_that_counts(void)
{
    open_switch_in_t in = {.i = {-I_MIN, I_MIN, -I_MIN - 1}, .i_squared_q30 = 4 * I_MIN * I_MIN, .step_q16 = 100};
    state = (open_switch_state_t){.one_sided_q16 = {5, 6, 7}};
    (void)open_switch_by_currents(&config, &state, &in);
    TEST_ASSERT_EQUAL_UINT16(105, state.one_sided_q16[0]);
    TEST_ASSERT_EQUAL_UINT16(106, state.one_sided_q16[1]);
    TEST_ASSERT_EQUAL_UINT16(0, state.one_sided_q16[2]);
    in.i_squared_q30--;
    (void)open_switch_by_currents(&config, &state, &in);
    TEST_ASSERT_EQUAL_UINT16(105, state.one_sided_q16[0]);
}

void test_a_new_beginning_has_turned_by_nothing(void)
{
    state = (open_switch_state_t){.has_begun = true, .turned_q16 = 65535};
    (void)with_flux(1000.0, 0.0, SMALL);
    TEST_ASSERT_EQUAL_UINT16(0, state.turned_q16);
    (void)with_flux(1000.0, 0.0, SMALL);
    TEST_ASSERT_EQUAL_UINT16(q16_of(0.05), state.turned_q16);
}

/* Flux across phase a: the s of the two others are equal and opposite, and the decision falls on the upper switches. */
void test_of_two_equal_sums_the_negative_one_decides(void)
{
    (void)with_flux(0.0, 0.0, SMALL);
    TEST_ASSERT_EQUAL(OPEN_SWITCH_UPPER, with_flux(0.0, 12000.0, SMALL));
}

void test_a_reset_begins_both_searches_anew(void)
{
    state = (open_switch_state_t){.has_begun = true, .one_sided_q16 = {5, 6, 7}};
    open_switch_reset(&state);
    TEST_ASSERT_FALSE(state.has_begun);
    for (int x = 0; x < 3; x++) {
        TEST_ASSERT_EQUAL_UINT16(0, state.one_sided_q16[x]);
    }
    const open_switch_in_t in = {.i = {5000, -2500, -2500}, .i_squared_q30 = 5000 * 5000, .step_q16 = q16_of(0.9)};
    for (int n = 0; n < 4; n++) {
        TEST_ASSERT_EQUAL(OPEN_SWITCH_NONE, open_switch_by_currents(&config, &state, &in));
        TEST_ASSERT_EQUAL(OPEN_SWITCH_NONE, with_flux(9000.0 * n, 0.0, SMALL));
        open_switch_reset(&state);
    }
}

void test_flux_and_angles_saturate(void)
{
    (void)with_flux(-32768.0, -32768.0, 0);
    TEST_ASSERT_EQUAL(OPEN_SWITCH_LOWER, with_flux(32767.0, 32767.0, 0));
    setUp();
    (void)with_flux(32767.0, 32767.0, 0);
    TEST_ASSERT_EQUAL(OPEN_SWITCH_UPPER, with_flux(-32768.0, -32768.0, 0));
    const open_switch_in_t in = {.i = {5000, -2500, -2500}, .i_squared_q30 = 5000 * 5000, .step_q16 = 65536};
    for (int n = 0; n < 5; n++) {
        (void)open_switch_by_currents(&config, &state, &in);
        TEST_ASSERT_EQUAL_UINT16(65535, state.one_sided_q16[0]);
    }
}
