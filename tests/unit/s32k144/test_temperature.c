/* SPDX-License-Identifier: Apache-2.0 */
/* Which steps convert which temperature. */
#include "hal/s32k144/temperature.h"

#include "hal/s32k144/sampling.h"
#include "hal/temperature.h"
#include "unity.h"

/* Nodes of the table: 20 and 30 degrees; beyond its range. */
#define AT_20 2249
#define AT_30 1854
#define BROKEN 4095

static uint16_t winding, inverter;
static int conversions;

uint16_t sampling_winding(void)
{
    conversions++;
    return winding;
}

uint16_t sampling_inverter(void)
{
    conversions++;
    return inverter;
}

uint16_t sampling_die(void)
{
    return 0;
}

/* The steps go on from test to test, as they do in the port. */
static void step(int n)
{
    for (; n > 0; n--) {
        temperature_tick();
    }
}

void setUp(void)
{
    winding = inverter = AT_20;
    step(8);
    conversions = 0;
}

void tearDown(void)
{
}

/* Runs first: the steps begin with it. */
void test_the_first_step_converts_both(void)
{
    TEST_ASSERT_EQUAL_INT(200, hal_temperature_winding_dC());
    TEST_ASSERT_EQUAL_INT(200, hal_temperature_inverter_dC());
}

void test_each_temperature_is_converted_once_in_eight_steps_and_never_both_in_one(void)
{
    for (int n = 0; n < 40; n++) {
        const int before = conversions;
        step(1);
        TEST_ASSERT_LESS_OR_EQUAL_INT(1, conversions - before);
    }
    TEST_ASSERT_EQUAL_INT(10, conversions);
}

void test_a_new_temperature_is_seen_within_eight_steps(void)
{
    winding = inverter = AT_30;
    step(8);
    TEST_ASSERT_EQUAL_INT(300, hal_temperature_winding_dC());
    TEST_ASSERT_EQUAL_INT(300, hal_temperature_inverter_dC());
}

void test_a_sensor_out_of_its_range_is_seen_within_eight_steps_and_its_return_in_the_next(void)
{
    winding = inverter = BROKEN;
    step(8);
    TEST_ASSERT_EQUAL_INT(TEMPERATURE_OUT_OF_RANGE, hal_temperature_winding_dC());
    TEST_ASSERT_EQUAL_INT(TEMPERATURE_OUT_OF_RANGE, hal_temperature_inverter_dC());
    winding = inverter = AT_30;
    step(1);
    TEST_ASSERT_EQUAL_INT(300, hal_temperature_winding_dC());
    TEST_ASSERT_EQUAL_INT(300, hal_temperature_inverter_dC());
}
