/* SPDX-License-Identifier: Apache-2.0 */
#include "ecu/battery_voltage.h"
#include "unity.h"

static battery_voltage_t state;
static battery_voltage_in_t in;

void setUp(void)
{
    state = (battery_voltage_t){0};
    in = (battery_voltage_in_t){
        .battery_V = 400.0F, .v_dc_V = 400.0F, .alive = true, .contactor = true, .elapsed_us = 1000};
}

void tearDown(void)
{
}

static bool contradicts_after(int steps)
{
    bool result = false;
    for (int n = 0; n < steps; n++) {
        result = battery_voltage_contradicts(&state, &in);
    }
    return result;
}

/* 5 % of 400 V are 20 V, on both sides. */
void test_near_is_within_5_percent_of_the_battery(void)
{
    static const struct {
        float v_dc_V;
        bool near;
    } cases[] = {{379.9F, false}, {380.0F, true},  {380.1F, true}, {419.9F, true},
                 {420.0F, true},  {420.1F, false}, {0.0F, false}};
    for (unsigned n = 0; n < sizeof cases / sizeof cases[0]; n++) {
        in.v_dc_V = cases[n].v_dc_V;
        TEST_ASSERT_EQUAL(cases[n].near, battery_voltage_is_near(&in));
    }
}

void test_without_a_known_voltage_every_dc_voltage_is_near_and_none_contradicts(void)
{
    in.battery_V = 0.0F;
    in.v_dc_V = 100.0F;
    TEST_ASSERT_TRUE(battery_voltage_is_near(&in));
    TEST_ASSERT_FALSE(contradicts_after(1000));
    in.alive = false;
    TEST_ASSERT_TRUE(battery_voltage_is_near(&in));
    TEST_ASSERT_FALSE(contradicts_after(1000));
}

/* A battery of a fraction of a volt is a broken one: its voltage is known, too. */
void test_every_voltage_above_zero_is_compared(void)
{
    in.battery_V = 0.1F;
    in.v_dc_V = 100.0F;
    TEST_ASSERT_FALSE(battery_voltage_is_near(&in));
    TEST_ASSERT_FALSE(contradicts_after(250));
    TEST_ASSERT_TRUE(contradicts_after(1));
}

void test_a_voltage_that_was_known_and_is_lost_is_not_near_and_contradicts_nothing(void)
{
    in.alive = false;
    TEST_ASSERT_FALSE(battery_voltage_is_near(&in));
    in.v_dc_V = 200.0F;
    TEST_ASSERT_FALSE(contradicts_after(1000));
}

/* 8 % of 400 V are 32 V. */
void test_a_mismatch_is_more_than_8_percent_for_more_than_250_ms(void)
{
    static const float beyond_V[] = {367.9F, 432.1F}, within_V[] = {368.1F, 431.9F};
    for (int side = 0; side < 2; side++) {
        setUp();
        in.v_dc_V = within_V[side];
        TEST_ASSERT_FALSE(contradicts_after(1000));
        in.v_dc_V = beyond_V[side];
        TEST_ASSERT_FALSE(contradicts_after(250));
        TEST_ASSERT_TRUE(contradicts_after(1));
        TEST_ASSERT_TRUE(contradicts_after(100000));
    }
}

/* The time does not wrap either, after more than an hour. */
void test_a_mismatch_of_250_ms_is_allowed_to_the_microsecond_and_a_longer_one_stays(void)
{
    in.v_dc_V = 300.0F;
    in.elapsed_us = 250000;
    TEST_ASSERT_FALSE(contradicts_after(1));
    in.elapsed_us = 1;
    TEST_ASSERT_TRUE(contradicts_after(1));
    in.elapsed_us = UINT32_MAX - 5000U;
    TEST_ASSERT_TRUE(contradicts_after(1));
}

void test_a_mismatch_must_last_without_a_break(void)
{
    in.v_dc_V = 300.0F;
    TEST_ASSERT_FALSE(contradicts_after(250));
    in.v_dc_V = 400.0F;
    TEST_ASSERT_FALSE(contradicts_after(1));
    in.v_dc_V = 300.0F;
    TEST_ASSERT_FALSE(contradicts_after(250));
}

/* The dc link may have any voltage while it is separated from the battery. */
void test_with_the_contactor_open_nothing_contradicts(void)
{
    in.v_dc_V = 0.0F;
    in.contactor = false;
    TEST_ASSERT_FALSE(contradicts_after(1000));
    in.contactor = true;
    TEST_ASSERT_FALSE(contradicts_after(250));
    TEST_ASSERT_TRUE(contradicts_after(1));
}
