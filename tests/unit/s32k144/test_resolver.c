/* SPDX-License-Identifier: Apache-2.0 */
/* The AD2S1210 with variables as LPSPI registers: RSR tells whether a frame was received, and RDR contains it. */
#include <string.h>

#include "hal/angle.h"
#include "hal/s32k144/ad2s1210.h"
#include "hal/s32k144/angle.h"
#include "hal/s32k144/pins.h"
#include "hal/s32k144/pwm.h"
#include "hal/s32k144/registers.h"
#include "hal/s32k144/resolver.h"
#include "unity.h"

lpspi_t fake_LPSPI0;
gpio_t fake_PTC;

static int samples;

void pwm_sample_by_hand(void)
{
    samples++;
}

static void received(uint32_t frame)
{
    const uint32_t not_empty = 0;
    memcpy((void *)(uintptr_t)&fake_LPSPI0.RSR, &not_empty, sizeof not_empty);
    memcpy((void *)(uintptr_t)&fake_LPSPI0.RDR, &frame, sizeof frame);
}

static void nothing_received(void)
{
    const uint32_t empty = LPSPI_RSR_RXEMPTY;
    memcpy((void *)(uintptr_t)&fake_LPSPI0.RSR, &empty, sizeof empty);
}

void setUp(void)
{
    nothing_received();
    angle_init(11200);
    received(0);
    (void)hal_angle_read();
}

void tearDown(void)
{
}

void test_start_up_reads_the_fault_register_after_a_sample_and_leaves_the_converter_in_position_mode(void)
{
    const uint32_t both = 1U << PIN_RESOLVER_A0 | 1U << PIN_RESOLVER_A1;
    samples = 0;
    received(0);
    fake_PTC = (gpio_t){0};
    angle_init(11200);
    TEST_ASSERT_EQUAL_INT(1, samples);
    TEST_ASSERT_EQUAL_HEX32(both, fake_PTC.PSOR);
    TEST_ASSERT_EQUAL_HEX32(AD2S1210_FAULT_REGISTER, fake_LPSPI0.TDR);
    TEST_ASSERT_EQUAL_HEX32(both, fake_PTC.PCOR);
    TEST_ASSERT_EQUAL_HEX32(23, fake_LPSPI0.TCR & 0xFFFU); /* frames of 24 bits */
}

void test_the_position_is_the_upper_half_of_the_angle(void)
{
    received(0x400000);
    TEST_ASSERT_EQUAL_HEX32(0x40000000, hal_angle_read());
    TEST_ASSERT_FALSE(angle_fault());
}

void test_any_bit_of_the_fault_register_is_a_fault_until_it_is_clear(void)
{
    for (uint32_t bit = 0; bit < 8; bit++) {
        received(0x123400U | 1U << bit);
        (void)hal_angle_read();
        TEST_ASSERT_TRUE(angle_fault());
    }
    received(0x123400);
    (void)hal_angle_read();
    TEST_ASSERT_FALSE(angle_fault());
}

void test_a_missing_frame_is_a_fault_and_the_last_angle_stays(void)
{
    received(0xABCD00);
    (void)hal_angle_read();
    nothing_received();
    TEST_ASSERT_EQUAL_HEX32(0xABCD0000, hal_angle_read());
    TEST_ASSERT_TRUE(angle_fault());
}

void test_velocity_of_the_period_before_is_kept_and_position_is_asked_for(void)
{
    fake_PTC.PCOR = 0;
    received(0xFF3800);
    angle_begin();
    TEST_ASSERT_EQUAL_INT16(-200, resolver_velocity());
    TEST_ASSERT_EQUAL_HEX32(1U << PIN_RESOLVER_A1, fake_PTC.PCOR);
    angle_end();
    TEST_ASSERT_EQUAL_HEX32(1U << PIN_RESOLVER_A1, fake_PTC.PSOR);
}
