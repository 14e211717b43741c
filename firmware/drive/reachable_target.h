/* SPDX-License-Identifier: Apache-2.0 */
#ifndef DRIVE_REACHABLE_TARGET_H
#define DRIVE_REACHABLE_TARGET_H
/** Target of current control for the wanted currents. While the voltage limit lasts near field weakening and v_d is
 * positive, the d flux is not asked to rise: the q axis then gets the voltage by which its flux falls. With both axes
 * at their bounds the machine could stay at one voltage of the circle, whatever is wanted.
 * Source   docs/theory/current-control.md (CC-26)
 * Units    per unit
 * Range    every snapshot
 * Errors   none
 * Context  1 kHz task, once in a step */
#include "drive/drive.h"

/** wanted: currents, their flux, and the speed; the same afterwards. */
static inline current_target_t reachable_target(drive_t *drive, const snapshot_t *snapshot, operating_point_t *wanted)
{
    const sample_t *sample = &snapshot->sample;
    rotating_flux_t *rotating = &drive->task.rotating;
    const int32_t psi_d = wanted->flux.psi_d;
    const bool weakens = drive->task.reference.psi_plan < drive->motor->psi_weak;
    if (weakens && rotating->limited && sample->voltage_limited && sample->point.u.d > 0) {
        wanted->flux.psi_d = fx_min_s32(psi_d, sample->point.flux.psi_d);
    }
    rotating->limited = sample->voltage_limited;
    const int32_t psi_d_error = current_control_by_target(snapshot->psi_d_error);
    const current_target_t target = current_control_target(&drive->parameters.current_control, wanted, psi_d_error,
                                                           rotating);
    wanted->flux.psi_d = psi_d;
    return target;
}

#endif
