/* SPDX-License-Identifier: Apache-2.0 */
#include "app/take_sample.h"

#include "hal/adc.h"
#include "hal/angle.h"

/* What the angle sensor is known to be wrong by, where it stands. */
static uint32_t correction(const drive_t *drive, uint32_t theta_m)
{
    const volatile int32_t *parts = drive->task.angle_correction;
    __asm__("" : "+r"(parts)); /* the address once: not part of every index */
    return (uint32_t)parts[theta_m >> ANGLE_HARMONICS_SHIFT];
}

seen_t take_sample(drive_t *drive, sample_t *sample, bool settled)
{
    adc_counts_t counts;
    hal_adc_read(&counts);
    const measure_t measured = measure_step(&drive->motor.measure, &counts);
    const fx_pair_t i_ab = fx_arch_pkhbt(measured.i.alpha, measured.i.beta);
    sample->i_ab = i_ab;
    sample->zero_q28 = measured.zero_q28;
    const uint32_t read = hal_angle_read();
    const uint32_t theta_m = read + correction(drive, read);
    sample->v_dc = measured.v_dc;
    sample->theta_m = theta_m;
    const angle_tracker_config_t *config = &drive->motor.angle_tracker;
    angle_tracker_state_t *tracker = &drive->fast.angle_tracker;
    const angle_t angle =
        settled ? angle_tracker_follow(config, tracker, theta_m) : angle_tracker_step(config, tracker, theta_m);
    sample->mrai.omega = angle.omega_q31;
    sample->theta_e = angle.theta_e;
    if (__builtin_expect(angle.jumped, 0)) {
        monitor_note_jump(&drive->fast.monitor);
        return (seen_t){angle.step, measured.v_dc, false};
    }
    return (seen_t){angle.step, measured.v_dc,
                    monitor_quiet(&drive->motor.monitor, i_ab, measured.zero_q28, measured.v_dc)};
}
