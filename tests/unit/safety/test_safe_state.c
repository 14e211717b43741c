/* SPDX-License-Identifier: Apache-2.0 */
#include "safety/safe_state.h"

#include "unity.h"

/* psi_f = 0.4: the line back-EMF is 0.6928 w. v_dc = 0.6: short above w = 0.7794, open below 0.6928. */
static const safe_state_config_t config = {
    .psi_f = 13107, .share_short = 29491, .share_open = 26214, .v_release = 24000};
static safe_state_state_t state;
static safe_state_in_t in;

void setUp(void)
{
    state = (safe_state_state_t){0};
    in = (safe_state_in_t){.v_dc = 19661, .speed_valid = true};
}

void tearDown(void)
{
}

static bool at(double omega)
{
    in.omega = (q15_t)(omega * 32768.0);
    return safe_state_step(&config, &state, &in);
}

void test_at_low_speed_switching_is_disabled_and_at_high_speed_the_phases_are_shorted(void)
{
    TEST_ASSERT_FALSE(at(0.0));
    TEST_ASSERT_FALSE(at(0.5));
    TEST_ASSERT_TRUE(at(0.9));
    TEST_ASSERT_TRUE(at(-0.9));
    TEST_ASSERT_FALSE(at(-0.5));
}

void test_between_the_thresholds_it_stays_as_it_was(void)
{
    TEST_ASSERT_FALSE(at(0.778));
    TEST_ASSERT_TRUE(at(0.781));
    TEST_ASSERT_TRUE(at(0.695));
    TEST_ASSERT_FALSE(at(0.691));
    TEST_ASSERT_FALSE(at(0.778));
}

void test_a_magnet_found_stronger_counts_and_one_found_weaker_does_not(void)
{
    in.psi_delta = 1311; /* + 10 %: short above 0.7085 */
    TEST_ASSERT_TRUE(at(0.72));
    in.psi_delta = -6000;
    TEST_ASSERT_FALSE(at(0.691));
    TEST_ASSERT_TRUE(at(0.781));
}

void test_without_dc_voltage_any_rotation_is_shorted(void)
{
    in.v_dc = 0;
    TEST_ASSERT_TRUE(at(0.01));
    TEST_ASSERT_FALSE(at(0.0));
    in.v_dc = -100;
    TEST_ASSERT_TRUE(at(0.01));
}

void test_without_a_valid_speed_the_last_one_counts_and_the_short_circuit_comes_earlier(void)
{
    TEST_ASSERT_FALSE(at(0.72)); /* above the lower threshold */
    in.speed_valid = false;
    TEST_ASSERT_TRUE(at(0.0));
    setUp();
    TEST_ASSERT_FALSE(at(0.6));
    in.speed_valid = false;
    TEST_ASSERT_FALSE(at(0.99));
}

void test_an_over_voltage_is_shorted_at_any_speed_until_the_voltage_has_come_back(void)
{
    in.over_voltage = true;
    in.v_dc = 28000;
    TEST_ASSERT_TRUE(at(0.0));
    in.v_dc = 24001;
    TEST_ASSERT_TRUE(at(0.0));
    in.v_dc = 24000;
    TEST_ASSERT_FALSE(at(0.0));
}

void test_no_argument_wraps(void)
{
    in.omega = INT16_MIN;
    in.psi_delta = INT16_MAX;
    in.v_dc = INT16_MAX;
    TEST_ASSERT_TRUE(safe_state_step(&config, &state, &in));
}
