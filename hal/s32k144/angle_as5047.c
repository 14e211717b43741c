/* SPDX-License-Identifier: Apache-2.0 */
#include "fx/q.h"
#include "hal/angle.h"
#include "hal/s32k144/angle.h"
#include "hal/s32k144/as5047.h"
#include "hal/s32k144/clock.h"
#include "hal/s32k144/core.h"
#include "hal/s32k144/registers.h"
#include "hal/s32k144/serial_angle.h"
#include "hal/s32k144/travel.h"

#define START_TICKS 1U     /* of the frame, from the start of the period */
#define REQUEST_CLOCKS 3U  /* of 28 MHz: until the module has seen the request */
#define TICKS_PER_CLOCK 4U /* 112 MHz/28 MHz */
#define COMMAND (LPSPI_TCR_FRAMESZ(AS5047_BITS - 1U) | LPSPI_TCR_CPHA | LPSPI_TCR_PRESCALE(0))
#define UNTIL_PWM_TICKS 200U /* from the end of the start's last wait to the first period */
#define FIRST_PER_S 10000U /* length of the first measurement of the speed */
#define TURN_COUNTS 16384.0F
#define COUNT_SHIFT 18

__asm__(".global angle_sensor_as5047\n.set angle_sensor_as5047, 1"); /* for tools; takes no memory */

static const serial_angle_timing_t timing = {.bit = 4, .select = 10, .gap = 10}; /* 7 MHz, 357 ns */
/* The encoder samples the angle when the frame that asks for it ends. */
#define FRAME_CLOCKS (timing.select + AS5047_BITS * timing.bit + SERIAL_ANGLE_RELEASE)
#define SAMPLED_TICKS (START_TICKS + TICKS_PER_CLOCK * (REQUEST_CLOCKS + FRAME_CLOCKS))

static travel_t encoder;
static bool healthy; /* the encoder's diagnostics at the start */

/* The answers come one frame after their commands. The last two frames here and the first one of the PWM are one period
 * apart, so that the angle is right from the first period on, at any speed. */
static void read_state_and_angle(uint32_t period_ticks)
{
    LPSPI0->TCR = COMMAND;
    (void)serial_angle_exchange(AS5047_READ_ERRORS); /* clears those of the power-up */
    (void)serial_angle_exchange(AS5047_READ_DIAGNOSTICS);
    const uint32_t diagnostics = serial_angle_exchange(AS5047_READ_ANGLE);
    core_pass(period_ticks - TICKS_PER_CLOCK * FRAME_CLOCKS);
    const uint32_t angle = serial_angle_exchange(AS5047_READ_ANGLE);
    core_pass(period_ticks - SAMPLED_TICKS - UNTIL_PWM_TICKS);
    healthy = as5047_is_healthy(diagnostics) && as5047_is_valid(angle);
    encoder.last = as5047_angle(angle);
}

void angle_init(uint32_t period_ticks)
{
    encoder.sampled_q32 = (int32_t)((UINT32_MAX / period_ticks) * SAMPLED_TICKS);
    encoder.travel = 0;
    encoder.invalid = 0;
    serial_angle_init(&timing);
    read_state_and_angle(period_ticks);
    serial_angle_start(&(serial_angle_t){.command = COMMAND, .word = AS5047_READ_ANGLE, .start = START_TICKS});
}

/* The frame before the measuring time requests the first angle, the frame after it the second. */
float angle_first_speed(void)
{
    serial_angle_init(&timing);
    LPSPI0->TCR = COMMAND;
    (void)serial_angle_exchange(AS5047_READ_ERRORS);
    (void)serial_angle_exchange(AS5047_READ_ANGLE);
    core_pass(CLOCK_FIRST_HZ / FIRST_PER_S);
    const uint32_t first = serial_angle_exchange(AS5047_READ_ANGLE);
    const uint32_t second = serial_angle_exchange(AS5047_READ_ANGLE);
    if (!as5047_is_valid(first) || !as5047_is_valid(second)) {
        return -1.0F;
    }
    const int32_t counts = (int32_t)(as5047_angle(second) - as5047_angle(first)) >> COUNT_SHIFT;
    return (float)fx_abs_q31(counts) * ((float)FIRST_PER_S / TURN_COUNTS);
}

/* The frame of this period has brought the angle that was sampled at the end of the last one, that is, one period less
 * sampled_q32 before the currents. Since then the rotor has moved by that share of its travel per period. After lost
 * periods several frames have arrived: the travel per period is then unknown, and the last known one is used. */
uint32_t hal_angle_read(void)
{
    uint32_t frame;
    const uint32_t frames = serial_angle_read(AS5047_READ_ANGLE, &frame);
    if (frames != 0U && as5047_is_valid(frame)) {
        travel_take(&encoder, as5047_angle(frame), frames == 1U);
    } else {
        travel_predict(&encoder);
    }
    return encoder.last + (uint32_t)encoder.travel - travel_share(&encoder);
}

bool hal_angle_is_absolute(void)
{
    return healthy;
}

uint32_t angle_follow_index(void)
{
    return 0;
}

bool angle_fault(void)
{
    return travel_is_lost(&encoder) || !healthy;
}
