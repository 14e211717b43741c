/* SPDX-License-Identifier: Apache-2.0 */
/* The counter of the encoder is read some ticks after the start of the period, for which the angle is needed. */
#include <string.h>

#include "hal/angle.h"
#include "hal/s32k144/angle.h"
#include "hal/s32k144/core.h"
#include "hal/s32k144/registers.h"
#include "unity.h"

#define PERIOD 11200U
#define TURN_COUNTS 16384U
#define COUNT_Q32 262144U /* of a turn: 2^32/16384 */

#define INDEX (1U << 12) /* of port D */
#define CAPTURED 0x80U

ftm_t fake_FTM0, fake_FTM2;
gpio_t fake_PTD;

void core_pass(uint32_t clocks)
{
    (void)clocks;
}

/* The level of the encoder's index. */
static void index_is(bool high)
{
    const uint32_t level = high ? INDEX : 0U;
    memcpy((void *)(uintptr_t)&fake_PTD.PDIR, &level, sizeof level);
}

/* A start on the index. */

void setUp(void)
{
    fake_FTM0 = (ftm_t){0};
    fake_FTM2 = (ftm_t){0};
    index_is(true);
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

static void start_beside_the_index(void)
{
    fake_FTM2 = (ftm_t){0};
    index_is(false);
    angle_init(PERIOD);
}

void test_the_angle_is_absolute_on_the_index(void)
{
    TEST_ASSERT_TRUE(hal_angle_is_absolute());
    TEST_ASSERT_EQUAL_UINT32(0, angle_follow_index());
    start_beside_the_index();
    TEST_ASSERT_FALSE(hal_angle_is_absolute());
    TEST_ASSERT_EQUAL_HEX32(FTM_C2SC_ELSA, FTM2->C2SC); /* takes the counter at a rising edge */
}

/* The index rose at 12345 while the shaft moved by 200 counts per period: from then on the angle is that of the shaft,
 * without a jump in the movement per period. */
void test_the_index_makes_the_angle_absolute(void)
{
    start_beside_the_index();
    FTM2->CNT = 12300;
    (void)hal_angle_read();
    TEST_ASSERT_EQUAL_UINT32(0, angle_follow_index());
    FTM2->C2V = 12345;
    FTM2->C2SC = FTM2->C2SC | CAPTURED;
    FTM0->CNT = 336;
    FTM2->CNT = 12500;
    TEST_ASSERT_EQUAL_HEX32((TURN_COUNTS - 12345U) * COUNT_Q32, angle_follow_index());
    TEST_ASSERT_TRUE(hal_angle_is_absolute());
    TEST_ASSERT_UINT32_WITHIN(8, (12500U - 6U - 12345U) * COUNT_Q32, hal_angle_read());
    TEST_ASSERT_EQUAL_UINT32(0, angle_follow_index());
}

void test_an_encoder_reports_no_fault(void)
{
    TEST_ASSERT_FALSE(angle_fault());
}
