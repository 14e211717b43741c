/* SPDX-License-Identifier: Apache-2.0 */
/* The counter of the encoder is read some ticks after the start of the period, for which the angle is needed. */
#include "hal/angle.h"
#include "hal/s32k144/angle.h"
#include "hal/s32k144/registers.h"
#include "unity.h"

#define PERIOD 11200U
#define TURN_COUNTS 16384U
#define COUNT_Q32 262144U /* of a turn: 2^32/16384 */

ftm_t fake_FTM0, fake_FTM2;

void setUp(void)
{
    fake_FTM0 = (ftm_t){0};
    fake_FTM2 = (ftm_t){0};
    angle_init(PERIOD);
}

void tearDown(void)
{
}

void test_at_rest_the_angle_is_that_of_the_counter(void)
{
    FTM2->CNT = 4096;
    (void)hal_angle_read();
    FTM0->CNT = 336;
    TEST_ASSERT_EQUAL_HEX32(0x40000000, hal_angle_read());
}

/* The shaft moves by 200 counts per period, and the counter is read 336 of 11200 ticks late, 6 counts too far. The
 * share per tick is rounded down by less than 2^-32, and the product to 2^-32 turn. */
void test_the_movement_since_the_start_of_the_period_is_subtracted(void)
{
    FTM2->CNT = 1000;
    (void)hal_angle_read();
    FTM0->CNT = 336;
    FTM2->CNT = 1200;
    TEST_ASSERT_UINT32_WITHIN(8, 1194U * COUNT_Q32, hal_angle_read());
}

void test_the_movement_is_subtracted_also_backwards_through_zero(void)
{
    FTM2->CNT = 50;
    (void)hal_angle_read();
    FTM0->CNT = 336;
    FTM2->CNT = TURN_COUNTS - 150U; /* 200 counts back */
    TEST_ASSERT_UINT32_WITHIN(8, (TURN_COUNTS - 144U) * COUNT_Q32, hal_angle_read());
}

void test_an_encoder_reports_no_fault(void)
{
    TEST_ASSERT_FALSE(angle_fault());
}
