/* SPDX-License-Identifier: Apache-2.0 */
#include <math.h>

#include "dc_link.h"
#include "unity.h"

#define DT 1e-4

static dc_link_params_t p;

void setUp(void)
{
    dc_link_params_default(&p, 350.0);
}

void tearDown(void)
{
}

static double run(dc_link_switches_t s, double v_V, double i_A, double seconds)
{
    for (long k = lround(seconds / DT); k > 0; k--) {
        v_V = dc_link_step(&p, s, v_V, i_A, DT);
    }
    return v_V;
}

/* v = V (1 - exp(-t/tau)); Euler with dt/tau = 0.005 is off by less than 0.3 % of V. */
void test_precharge_follows_an_exponential(void)
{
    const dc_link_switches_t s = {.precharge = true};
    TEST_ASSERT_DOUBLE_WITHIN(1.0, 350.0 * (1.0 - exp(-1.0)), run(s, 0.0, 0.0, p.precharge_s));
    TEST_ASSERT_DOUBLE_WITHIN(1.0, 350.0, run(s, 0.0, 0.0, 10.0 * p.precharge_s));
}

void test_discharge_follows_an_exponential_down_to_the_least(void)
{
    const dc_link_switches_t s = {.discharge = true};
    TEST_ASSERT_DOUBLE_WITHIN(1.0, 350.0 * exp(-1.0), run(s, 350.0, 0.0, p.discharge_s));
    TEST_ASSERT_EQUAL_DOUBLE(1.0, run(s, 350.0, 0.0, 10.0));
}

void test_the_contactor_ties_the_link_to_the_battery(void)
{
    const dc_link_switches_t s = {.contactor = true, .precharge = true};
    TEST_ASSERT_EQUAL_DOUBLE(350.0, run(s, 10.0, 500.0, DT));
    p.contactor_open = 1.0;
    TEST_ASSERT_TRUE(run(s, 10.0, 0.0, DT) < 20.0);
}

/* 1 A for 10 ms out of 500 uF is 20 V. */
void test_without_a_battery_the_bridge_charges_and_discharges_the_capacitor(void)
{
    const dc_link_switches_t none = {0};
    TEST_ASSERT_DOUBLE_WITHIN(1e-9, 280.0, run(none, 300.0, 1.0, 0.01));
    TEST_ASSERT_DOUBLE_WITHIN(1e-9, 320.0, run(none, 300.0, -1.0, 0.01));
    TEST_ASSERT_EQUAL_DOUBLE(1.0, run(none, 300.0, 1.0, 1.0));
}

void test_a_switch_that_does_not_close_does_nothing(void)
{
    p.precharge_open = p.discharge_open = 1.0;
    const dc_link_switches_t both = {.precharge = true, .discharge = true};
    TEST_ASSERT_EQUAL_DOUBLE(123.0, run(both, 123.0, 0.0, 1.0));
}
