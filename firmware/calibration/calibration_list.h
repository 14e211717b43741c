/* SPDX-License-Identifier: Apache-2.0 */
#ifndef CALIBRATION_CALIBRATION_LIST_H
#define CALIBRATION_CALIBRATION_LIST_H
/** The values that may be calibrated while the drive runs, each with its range and unit. The calibration page, the
 *   range checks, the names in software in the loop and the A2L file are generated from this list.
 *   X(name, lowest, highest, unit, text); optional values come last, so that leaving them out moves no other
 * Source   docs/howto/xcp.md
 * Units    in each line
 * Range    a write access refuses a value outside its range
 * Context  calibration/calibration.c connects each value with the motor data */

#include "calibration/mrai/mrai_calibration_list.h"

#define CALIBRATION_LIST(X) \
    X(torque_slew_Nm_per_s, 0.0F, 1e6F, "Nm/s", "Slew limit of the commanded torque, 0: open") \
    X(torque_loop_bandwidth_rad_s, 0.0F, 500.0F, "rad/s", "Bandwidth of the torque loop") \
    X(dead_time_compensation, 0.0F, 1.5F, "", "Compensated share of dead time and device drop, 1: of motor.toml") \
    MRAI_CALIBRATION_LIST(X)

#endif
