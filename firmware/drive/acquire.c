/* SPDX-License-Identifier: Apache-2.0 */
#include "drive/acquire.h"

#include "fx/codegen.h"
#include "hal/adc.h"
#include "hal/angle.h"

/* The known error of the angle sensor at this position. */
static uint32_t angle_correction(const drive_t *drive, uint32_t theta_m)
{
    const volatile int32_t *correction = &drive->task.angle_correction[0] + (theta_m >> ANGLE_HARMONICS_SHIFT);
    return (uint32_t)*correction;
}

/* The prediction replaces a sample of the angle that no rotor can have. Only the advance per period still contains the
 * sample: by at most k_i/2 of a turn, 0.2 degrees. */
static void replace_angle(drive_t *drive, sample_t *sample)
{
    const angle_t angle = angle_tracker_coast(&drive->period.angle_tracker, &drive->fast.angle_tracker,
                                              sample->theta_e);
    sample->point.omega = angle.omega_q31;
    sample->theta_e = angle.theta_e;
}

/* A sample that has jumped or repeats the last reading. */
static FX_NOT_INLINED void check_angle(drive_t *drive, sample_t *sample, int32_t step, bool jumped, bool repeated)
{
    angle_tracker_state_t *tracker = &drive->fast.angle_tracker;
    angle_t angle = {sample->theta_e, step, sample->point.omega, jumped};
    angle_repeat_t meaning = ANGLE_FOLLOWED;
    if (repeated) {
        meaning = angle_tracker_repeated(&drive->period.angle_tracker, tracker, &angle, drive->samples.generation);
    }
    if (meaning == ANGLE_STUCK ? !angle_tracker_may_stop(&drive->period.angle_tracker, tracker) : angle.jumped) {
        monitor_report_angle_jump(&drive->fast.monitor);
    }
    if (meaning == ANGLE_STUCK || angle.jumped) {
        replace_angle(drive, sample);
    } else {
        sample->point.omega = angle.omega_q31;
    }
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
    /* In the usual route a repeated reading is noticed at the end of the period (publish_sample()). */
    const bool repeated = !settled && theta_m == tracker->theta_m;
    if (angle.jumped || repeated) {
        check_angle(drive, sample, angle.step, angle.jumped, repeated);
        return (acquired_t){angle.step, false};
    }
    const bool normal = monitor_is_sample_normal(&drive->period.monitor, i_ab, measured.zero_q28, measured.v_dc);
    return (acquired_t){angle.step, normal};
}

/* Over-voltage by the last two samples before this one, and whether such a rise can be the link's. */
static uint32_t check_rise(drive_t *drive, int32_t v_dc, uint32_t of_sample)
{
    const monitor_config_t *config = &drive->period.monitor;
    const uint32_t generation = drive->samples.generation; /* of the last sample */
    const int32_t last = sample_box_at(&drive->samples, generation)->v_dc;
    const int32_t before = sample_box_at(&drive->samples, generation - 1U)->v_dc;
    const bool expected = monitor_is_over_voltage_expected(config, v_dc, last, before);
    const uint32_t faults = expected ? of_sample | FAULT_OVER_VOLTAGE : of_sample;
    if ((faults & ~drive->fast.faults & FAULT_OVER_VOLTAGE) != 0U) {
        drive->fast.short_circuit.ignores_voltage = monitor_is_rise_of_sensor(config, last, before);
    }
    return faults;
}

abc_q15_t acquire_check(drive_t *drive, const sample_t *sample, bool run)
{
    const monitor_config_t *config = &drive->period.monitor;
    const monitor_in_t in = {.i = measure_phases(sample->i_ab, sample->zero_q28), .v_dc = sample->v_dc};
    const uint32_t faults = check_rise(drive, in.v_dc, monitor_step(config, &drive->fast.monitor, &in));
    if (in.v_dc < config->v_min) {
        /* Below v_min the applied voltage is unknown; the three-period count starts again. */
        drive->fast.periods_since_enable = 0;
    }
    if ((faults & FAULT_ANGLE) != 0U) {
        drive->fast.angle_tracker.samples = 0; /* the prediction has been wrong for milliseconds: start again */
    }
    if (faults != 0U) {
        /* A bridge that is off may have no dc voltage: under-voltage counts only while it runs. */
        drive_raise_fault(drive, run ? faults : faults & ~(uint32_t)FAULT_UNDER_VOLTAGE);
    }
    return in.i;
}
