/* SPDX-License-Identifier: Apache-2.0 */
#include "fx/q.h"
#include "hal/angle.h"
#include "hal/s32k144/angle.h"
#include "hal/s32k144/excitation.h"
#include "hal/s32k144/sampling.h"
#include "hal/s32k144/sincos.h"
#include "hal/s32k144/travel.h"

#define ANGLE_ONE 4294967296.0F

/* For tools; takes no memory. */
#if ANGLE_EXCITED
__asm__(".global angle_sensor_analogue\n.set angle_sensor_analogue, 2");
#else
__asm__(".global angle_sensor_analogue\n.set angle_sensor_analogue, 1");
#endif

static travel_t sensor;
static sincos_point_t point;

/* No angle is known before the first valid sample: if the first sample is outside the band, that is a fault at once. */
void angle_init(uint32_t period_ticks)
{
    sensor.sampled_q32 = (int32_t)((UINT32_MAX / period_ticks) * SAMPLING_ANGLE_TICKS);
    sensor.travel = 0;
    sensor.invalid = TRAVEL_INVALID_MAX;
    point = (sincos_point_t){0};
    excitation_start(period_ticks);
}

/* Speed from two angles. An offset or amplitude error of x % of the amplitude falsifies the speed by x %. */
float angle_first_speed(void)
{
    excitation_first();
    sampling_first_end();
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

/* Sine and cosine were sampled after the currents; the rotor has moved on by that share of the travel of a period. */
uint32_t hal_angle_read(void)
{
    const angle_counts_t counts = sampling_angle();
    const sincos_t at = sincos_scaled(counts.sine, counts.cosine);
    if (sincos_is_valid(at) && sincos_both_move(&point, at)) {
        travel_take(&sensor, sincos_angle(at), true);
    } else {
        travel_predict(&sensor);
    }
    return sensor.last - travel_share(&sensor);
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
    return travel_is_lost(&sensor);
}
