/* SPDX-License-Identifier: Apache-2.0 */
/* The AD2S1210 with variables as LPSPI registers: FSR counts the words in both FIFOs, and RDR contains the frame. */
#include <string.h>

#include "hal/angle.h"
#include "hal/s32k144/ad2s1210.h"
#include "hal/s32k144/angle.h"
#include "hal/s32k144/pins.h"
#include "hal/s32k144/pwm.h"
#include "hal/s32k144/registers.h"
#include "hal/s32k144/sampling.h"
#include "hal/s32k144/startup.h"
#include "unity.h"

#define FIFO_WORDS 4U

lpspi_t fake_LPSPI0;
gpio_t fake_PTC;
trgmux_t fake_TRGMUX;

static int samples;
static uint32_t pulse_from, pulse_until;

void pwm_sample_by_hand(void)
{
    samples++;
}

void sampling_pulse(uint32_t from, uint32_t until)
{
    pulse_from = from;
    pulse_until = until;
}

void await(const volatile uint32_t *word, uint32_t mask, uint32_t value)
{
    TEST_ASSERT_EQUAL_PTR(&fake_LPSPI0.FSR, word);
    TEST_ASSERT_EQUAL_HEX32(value, *word & mask);
}

static void fifos(uint32_t received, uint32_t to_send)
{
    const uint32_t state = received << 16 | to_send, empty = received == 0U ? LPSPI_RSR_RXEMPTY : 0U;
    memcpy((void *)(uintptr_t)&fake_LPSPI0.FSR, &state, sizeof state);
    memcpy((void *)(uintptr_t)&fake_LPSPI0.RSR, &empty, sizeof empty);
}

static void frame(uint32_t content)
{
    memcpy((void *)(uintptr_t)&fake_LPSPI0.RDR, &content, sizeof content);
}

static void received(uint32_t content)
{
    fifos(1, FIFO_WORDS - 1U);
    frame(content);
}

static void initialised(void)
{
    fifos(0, 0);
    angle_init(11200);
}

void setUp(void)
{
    initialised();
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
    fake_PTC.PSOR = fake_PTC.PCOR = 0;
    fifos(1, 0); /* answers at once */
    angle_init(11200);
    TEST_ASSERT_EQUAL_INT(1, samples);
    TEST_ASSERT_EQUAL_HEX32(both, fake_PTC.PSOR);
    TEST_ASSERT_EQUAL_HEX32(both, fake_PTC.PCOR);
    TEST_ASSERT_EQUAL_HEX32(23, fake_LPSPI0.TCR & 0xFFFU); /* frames of 24 bits */
}

void test_the_pulse_of_the_delay_block_starts_the_frames(void)
{
    TEST_ASSERT_EQUAL_HEX32(7, fake_LPSPI0.CFGR0); /* request: enabled, active high, by the trigger */
    TEST_ASSERT_EQUAL_UINT32(36, fake_TRGMUX.TRGMUX_LPSPI0);
    TEST_ASSERT_GREATER_OR_EQUAL_UINT32(85, pulse_from);               /* 752 ns after SAMPLE */
    TEST_ASSERT_GREATER_OR_EQUAL_UINT32(pulse_from + 8U, pulse_until); /* two clocks of the LPSPI */
    TEST_ASSERT_LESS_OR_EQUAL_UINT32(pulse_from + 192U, pulse_until);  /* 24 bits at 14 MHz */
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

void test_the_third_missing_frame_is_a_fault_and_the_last_angle_stays(void)
{
    received(0xABCD00);
    (void)hal_angle_read();
    fifos(0, FIFO_WORDS);
    for (int lost = 1; lost <= 3; lost++) {
        TEST_ASSERT_EQUAL_HEX32(0xABCD0000, hal_angle_read());
        TEST_ASSERT_EQUAL(lost == 3, angle_fault());
    }
}

/* Longer than the byte in which they are counted. */
void test_missing_frames_are_a_fault_until_one_comes(void)
{
    received(0xABCD00);
    (void)hal_angle_read();
    fifos(0, FIFO_WORDS);
    for (int lost = 1; lost <= 1000; lost++) {
        TEST_ASSERT_EQUAL_HEX32(0xABCD0000, hal_angle_read());
        TEST_ASSERT_EQUAL(lost >= 3, angle_fault());
    }
    received(0x123400);
    TEST_ASSERT_EQUAL_HEX32(0x12340000, hal_angle_read());
    TEST_ASSERT_FALSE(angle_fault());
}

/* Without a word left to send, the last period may have had none: the newest frame may be old. */
void test_a_frame_counts_only_while_a_word_is_left_to_send(void)
{
    received(0xABCD00);
    (void)hal_angle_read();
    frame(0x111100);
    fifos(3, 1);
    TEST_ASSERT_EQUAL_HEX32(0x11110000, hal_angle_read());
    TEST_ASSERT_FALSE(angle_fault());
    frame(0x222200);
    fifos(4, 0);
    TEST_ASSERT_EQUAL_HEX32(0x11110000, hal_angle_read());
}
