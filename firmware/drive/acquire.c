/* SPDX-License-Identifier: Apache-2.0 */
#include "drive/acquire.h"

#include "hal/adc.h"
#include "hal/angle.h"

/* The known error of the angle sensor at this position. */
static uint32_t angle_correction(const drive_t *drive, uint32_t theta_m)
{
    return (uint32_t)drive->task.angle_correction[theta_m >> ANGLE_HARMONICS_SHIFT];
}

/* A sample of the angle that no rotor can have: the prediction replaces it. Only the advance per period is still the
 * one of the sample, by at most k_i/2 of a turn, 0.2 degrees. */
static __attribute__((noinline)) void replace_angle(drive_t *drive, sample_t *sample)
{
    const angle_t angle = angle_tracker_coast(&drive->period.angle_tracker, &drive->fast.angle_tracker,
                                              sample->theta_e);
    sample->point.omega = angle.omega_q31;
    sample->theta_e = angle.theta_e;
    monitor_report_angle_jump(&drive->fast.monitor);
}

acquired_t acquire_sample(drive_t *drive, sample_t *sample, bool settled)
{
    adc_counts_t counts;
    hal_adc_read(&counts);
    const measure_t measured = measure_step(&drive->period.measure, &counts);
    const fx_pair_t i_ab = fx_pair(measured.i.alpha, measured.i.beta);
    sample->i_ab = i_ab;
    sample->zero_q28 = measured.zero_q28;
    const uint32_t read = hal_angle_read();
    const uint32_t theta_m = read + angle_correction(drive, read);
    sample->v_dc = measured.v_dc;
    sample->theta_m = theta_m;
    const angle_tracker_config_t *config = &drive->period.angle_tracker;
    angle_tracker_state_t *tracker = &drive->fast.angle_tracker;
    const angle_t angle = settled ? angle_tracker_follow(config, tracker, theta_m)
                                  : angle_tracker_step(config, tracker, theta_m);
    sample->point.omega = angle.omega_q31;
    sample->theta_e = angle.theta_e;
    if (__builtin_expect(angle.jumped, 0)) {
        replace_angle(drive, sample);
        return (acquired_t){angle.step, false};
    }
    const bool normal = monitor_is_sample_normal(&drive->period.monitor, i_ab, measured.zero_q28, measured.v_dc);
    return (acquired_t){angle.step, normal};
}
