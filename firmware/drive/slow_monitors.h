/* SPDX-License-Identifier: Apache-2.0 */
#ifndef DRIVE_SLOW_MONITORS_H
#define DRIVE_SLOW_MONITORS_H
/** The monitors of the 1 kHz task, with the last sample and the references that were in effect.
 * Source   docs/theory/monitors.md, docs/architecture.md
 * Units    per unit of motor.bases
 * Range    every snapshot
 * Errors   returns the confirmed faults; the fast ISR latches them, as it alone writes the fault word
 * Context  1 kHz task, before this step's references */
#include "drive/drive.h"

uint32_t slow_monitors_step(drive_t *drive, const snapshot_t *snapshot);

/** For test rigs without a machine, whose currents do not follow the voltage: disables the monitors that need one. */
static inline void slow_monitors_without_machine(motor_t *m)
{
    m->plausibility.e_0 = Q15_MAX;
    m->plausibility.i_alive = Q15_MAX;
    m->plausibility.ripple_max = Q15_MAX;
    m->plausibility.zero_error_max = Q15_MAX;
    m->gate_fault.i_alive = Q15_MAX;
    m->plausibility.gate_exceeded_steps = UINT8_MAX;
    m->torque_monitor.v_0 = Q15_MAX;
    m->frozen_angle.v_0 = Q15_MAX;
    m->launch_power.i_min = Q15_MAX;
}

#endif
