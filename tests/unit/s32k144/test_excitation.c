/* SPDX-License-Identifier: Apache-2.0 */
/* The excitation of a resolver: what the output does over time, recorded from the calls of the timer's port. */
#include "hal/s32k144/excitation.h"

#include <math.h>

#include "hal/s32k144/pwm.h"
#include "hal/s32k144/registers.h"
#include "hal/s32k144/sampling.h"
#include "hal/s32k144/sincos.h"
#include "unity.h"

#define PERIOD 11200U
#define TURN_RAD 6.283185307179586

ftm_t fake_FTM0;
adc_t fake_ADC0, fake_ADC1;
static bool high;
static uint32_t now, rises, last_rise, longest, pulse_from, pulse_until, by_timer, calibrated;

void core_pass(uint32_t clocks)
{
    now += clocks;
}

bool sampling_first_calibrates(void)
{
    return now < calibrated;
}

void pwm_hold_pulse(bool level)
{
    if (level && !high) {
        longest = (rises > 0U && now - last_rise > longest) ? now - last_rise : longest;
        last_rise = now;
        rises++;
    }
    high = level;
}

void pwm_pulse(uint32_t from, uint32_t until)
{
    pulse_from = from;
    pulse_until = until;
    by_timer++;
}

void setUp(void)
{
    high = false;
    now = rises = last_rise = longest = by_timer = calibrated = 0;
    fake_FTM0.MOD = PERIOD - 1U;
}

void tearDown(void)
{
}

/* The output rises where the tracks are sampled, from the first pulse by software to those of the timer without a gap
 * in between: the counter starts when excitation_start() returns. */
void test_the_output_rises_once_per_period_where_the_tracks_are_sampled(void)
{
    excitation_start(PERIOD);
    TEST_ASSERT_EQUAL_UINT32(10, rises);
    TEST_ASSERT_EQUAL_UINT32(PERIOD, longest);
    TEST_ASSERT_EQUAL_UINT32(1, by_timer);
    TEST_ASSERT_EQUAL_UINT32(SAMPLING_ANGLE_TICKS, pulse_from);
    TEST_ASSERT_EQUAL_UINT32(PERIOD / 2U, pulse_until - pulse_from);
    TEST_ASSERT_EQUAL_UINT32(PERIOD, now + pulse_from - last_rise);
    TEST_ASSERT_FALSE(high);
}

/* 48 MHz instead of 112: 4800 clocks of 100 us. */
void test_before_the_clocks_are_set_up_the_period_is_the_same(void)
{
    excitation_first();
    TEST_ASSERT_EQUAL_UINT32(10, rises);
    TEST_ASSERT_EQUAL_UINT32(4800, longest);
    TEST_ASSERT_FLOAT_WITHIN(0.1F, 10000.0F, excitation_pass());
    TEST_ASSERT_EQUAL_UINT32(4800, now - last_rise);
    TEST_ASSERT_EQUAL_UINT32(0, by_timer);
}

/* The converters need a little more than 12 periods: the pulses continue, and the last one is complete. */
void test_the_output_is_switched_until_the_converters_have_been_calibrated(void)
{
    calibrated = 12 * 4800 + 100;
    excitation_first();
    TEST_ASSERT_EQUAL_UINT32(13, rises);
    TEST_ASSERT_EQUAL_UINT32(4800, longest);
    TEST_ASSERT_EQUAL_UINT32(4800, now - last_rise);
}

/* At the negative peak both tracks have the other sign. */
void test_the_negative_peak_is_demodulated(void)
{
    for (int degree = -179; degree < 180; degree += 7) {
        const double at = degree / 360.0 * TURN_RAD;
        const sincos_t scaled = sincos_scaled((uint32_t)lround(2048.0 - 1638.0 * sin(at)),
                                              (uint32_t)lround(2048.0 - 1638.0 * cos(at)));
        TEST_ASSERT_DOUBLE_WITHIN(9e-4, at, (double)(int32_t)sincos_angle(scaled) / 4294967296.0 * TURN_RAD);
    }
}
