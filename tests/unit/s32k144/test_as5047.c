/* SPDX-License-Identifier: Apache-2.0 */
/* The AS5047P with variables as LPSPI registers: FSR counts the words in both FIFOs, and RDR contains the frame. */
#include <string.h>

#include "hal/angle.h"
#include "hal/s32k144/angle.h"
#include "hal/s32k144/as5047.h"
#include "hal/s32k144/core.h"
#include "hal/s32k144/registers.h"
#include "hal/s32k144/sampling.h"
#include "hal/s32k144/startup.h"
#include "unity.h"

#define FIFO_WORDS 4U
#define PERIOD 11200U
#define SAMPLED 325.0 /* ticks: 1, then 3 + 10 + 64 + 4 clocks of 4 */
#define COUNT_Q32 262144.0
#define HEALTHY 0x8100U /* DIAAGC: the loops have settled; with its parity */

lpspi_t fake_LPSPI0;
trgmux_t fake_TRGMUX;

static uint32_t pulse_from, pulse_until, passed;

void core_pass(uint32_t clocks)
{
    passed += clocks;
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

static uint32_t with_parity(uint32_t content)
{
    return content | (uint32_t)(__builtin_popcount(content) & 1) << 15;
}

/* One period with this frame. */
static uint32_t read_frame(uint32_t content)
{
    fifos(1, FIFO_WORDS - 1U);
    frame(content);
    return hal_angle_read();
}

static uint32_t read_count(uint32_t count)
{
    return read_frame(with_parity(count & 0x3FFFU));
}

/* Every answer of the start is this frame. */
static void start(uint32_t content)
{
    fifos(1, 0);
    frame(content);
    passed = 0;
    angle_init(PERIOD);
    TEST_ASSERT_UINT32_WITHIN(PERIOD / 10U, 2U * PERIOD, passed); /* two periods of the PWM before it starts */
}

void setUp(void)
{
    start(HEALTHY);
}

void tearDown(void)
{
}

void test_the_parities_are_even(void)
{
    for (uint32_t word = 0; word < 65536U; word++) {
        TEST_ASSERT_EQUAL(__builtin_popcount(word) % 2 == 0, as5047_is_even(word));
    }
    TEST_ASSERT_TRUE(as5047_is_even(AS5047_READ_ERRORS));
    TEST_ASSERT_TRUE(as5047_is_even(AS5047_READ_DIAGNOSTICS));
    TEST_ASSERT_TRUE(as5047_is_even(AS5047_READ_ANGLE));
}

/* Low and high lines, loops that have not settled, and a field that is too weak. */
void test_an_encoder_that_is_not_healthy_at_the_start_has_no_angle(void)
{
    TEST_ASSERT_TRUE(hal_angle_is_absolute());
    TEST_ASSERT_EQUAL_UINT32(0, angle_follow_index());
    static const uint32_t wrong[] = {0U, 0xFFFFU, 0x0003U, 0x0900U, 0x0500U, 0x0300U, 0x0100U, 0xC100U};
    for (unsigned k = 0; k < sizeof wrong / sizeof wrong[0]; k++) {
        start(wrong[k]);
        TEST_ASSERT_FALSE(hal_angle_is_absolute());
        (void)read_count(100);
        TEST_ASSERT_TRUE(angle_fault());
    }
}

void test_the_frames_start_with_the_period(void)
{
    TEST_ASSERT_EQUAL_HEX32(AS5047_READ_ANGLE, fake_LPSPI0.TDR);
    TEST_ASSERT_EQUAL_HEX32(AS5047_BITS - 1, fake_LPSPI0.TCR & 0xFFFU);
    TEST_ASSERT_EQUAL_UINT32(1, pulse_from);
    TEST_ASSERT_GREATER_OR_EQUAL_UINT32(pulse_from + 8U, pulse_until);
}

void test_at_rest_the_angle_is_that_of_the_frame(void)
{
    for (int n = 0; n < 3; n++) {
        (void)read_count(0x1000);
    }
    TEST_ASSERT_EQUAL_HEX32(0x40000000, read_count(0x1000));
    TEST_ASSERT_FALSE(angle_fault());
}

/* A frame brings the angle of 325 ticks after the last period's start; the rotor turns by 200 counts per period. */
void test_the_movement_since_the_sample_is_added(void)
{
    for (int sign = -1; sign <= 1; sign += 2) {
        (void)read_count((uint32_t)(8000 - sign * 200));
        (void)read_count(8000);
        const double counts = 8000.0 + sign * 200.0 + sign * 200.0 * (1.0 - SAMPLED / PERIOD);
        TEST_ASSERT_DOUBLE_WITHIN(64.0, counts * COUNT_Q32, read_count((uint32_t)(8000 + sign * 200)));
    }
}

void test_a_disturbed_frame_is_predicted_and_the_third_is_a_fault(void)
{
    static const uint32_t disturbed[] = {0x0001U, 0xC000U, 0xFFFFU}; /* parity, error flag with parity, high */
    for (unsigned k = 0; k < sizeof disturbed / sizeof disturbed[0]; k++) {
        start(HEALTHY);
        (void)read_count(1000);
        (void)read_count(1100);
        const uint32_t before = read_count(1200);
        for (uint32_t n = 1; n <= 3; n++) {
            TEST_ASSERT_EQUAL_HEX32(before + n * 100U * (uint32_t)COUNT_Q32, read_frame(disturbed[k]));
            TEST_ASSERT_EQUAL(n == 3, angle_fault());
        }
        (void)read_count(1600);
        TEST_ASSERT_FALSE(angle_fault());
    }
}

/* Without a frame, or with several of which only the newest is of this period, the movement stays as it was. */
void test_lost_periods_do_not_change_the_movement(void)
{
    (void)read_count(1000);
    (void)read_count(1100);
    const uint32_t before = read_count(1200);
    fifos(0, FIFO_WORDS);
    TEST_ASSERT_EQUAL_HEX32(before + 100U * (uint32_t)COUNT_Q32, hal_angle_read());
    (void)read_count(1400);
    fifos(2, FIFO_WORDS - 2U);
    frame(with_parity(1600));
    TEST_ASSERT_EQUAL_HEX32(before + 400U * (uint32_t)COUNT_Q32, hal_angle_read());
}
