/* SPDX-License-Identifier: Apache-2.0 */
#include "fx/q.h"
#include "hal/angle.h"
#include "hal/s32k144/angle.h"
#include "hal/s32k144/excitation.h"
#include "hal/s32k144/sampling.h"
#include "hal/s32k144/sincos.h"
#include "signal/counter.h"

#define INVALID_MAX 3U     /* periods in a row outside the band that are the angle fault */
#define ANGLE_ONE 4294967296.0F

/* For tools; takes no memory. */
#if ANGLE_EXCITED
__asm__(".global angle_sensor_analogue\n.set angle_sensor_analogue, 2");
#else
__asm__(".global angle_sensor_analogue\n.set angle_sensor_analogue, 1");
#endif

/* Debuggers find the counter by its name. */
struct {
    uint16_t invalid; /* samples outside the band */
} angle_errors;

static struct {
    uint32_t last;       /* reading of the period before */
    int32_t travel;      /* from one period to the next */
    int32_t sampled_q32; /* instant of the sample in its period, as a share of the period: 2^32 = 1 */
    uint16_t invalid;    /* in a row */
} sensor;

/* No angle is known before the first valid sample: a first one outside the band is the fault at once. */
void angle_init(uint32_t period_ticks)
{
    sensor.sampled_q32 = (int32_t)((UINT32_MAX / period_ticks) * SAMPLING_ANGLE_TICKS);
    sensor.travel = 0;
    sensor.invalid = INVALID_MAX;
    excitation_start(period_ticks);
}

/* Two angles; the offsets' and amplitudes' errors falsify the speed by as much as their share of the amplitude. */
float angle_first_speed(void)
{
    sampling_first_calibrate();
    excitation_first();
    const angle_counts_t from = sampling_first_angle();
    const float per_s = excitation_pass();
    const angle_counts_t to = sampling_first_angle();
    const sincos_t first = sincos_scaled(from.sine, from.cosine), second = sincos_scaled(to.sine, to.cosine);
    if (!sincos_is_valid(first) || !sincos_is_valid(second)) {
        return -1.0F;
    }
    const int32_t turned = (int32_t)(sincos_angle(second) - sincos_angle(first));
    return (float)fx_abs_q31(turned) * (per_s / ANGLE_ONE);
}

static inline void take(uint32_t now)
{
    if (__builtin_expect(sensor.invalid == 0U, 1)) {
        sensor.travel = (int32_t)(now - sensor.last);
    }
    sensor.last = now;
    sensor.invalid = 0;
}

/* In place of a sample outside the band: the rotor has moved on as before. */
static __attribute__((noinline, cold)) void predict(void)
{
    sensor.last += (uint32_t)sensor.travel;
    count_up(&sensor.invalid);
    count_up(&angle_errors.invalid);
}

/* Sine and cosine were sampled after the currents; the rotor has moved on by that share of the travel of a period. */
uint32_t hal_angle_read(void)
{
    const angle_counts_t counts = sampling_angle();
    const sincos_t at = sincos_scaled(counts.sine, counts.cosine);
    if (__builtin_expect(sincos_is_valid(at), 1)) {
        take(sincos_angle(at));
    } else {
        predict();
    }
    return sensor.last - (uint32_t)fx_mulhi(sensor.travel, sensor.sampled_q32);
}

bool hal_angle_is_absolute(void)
{
    return true;
}

uint32_t angle_follow_index(void)
{
    return 0;
}

bool angle_fault(void)
{
    return sensor.invalid >= INVALID_MAX;
}
