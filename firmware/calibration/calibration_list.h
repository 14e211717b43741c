/* SPDX-License-Identifier: Apache-2.0 */
#ifndef CALIBRATION_CALIBRATION_LIST_H
#define CALIBRATION_CALIBRATION_LIST_H
/** What may be calibrated while the drive runs: the one place that names a value, its range and its unit. Page, checks,
 *   software-in-the-loop names and the description file for calibration tools follow from it.
 *   X(name, lowest, highest, unit, text)
 * Source   docs/howto/xcp.md
 * Range    a value outside is refused by whoever writes it
 * Context  calibration/calibration.c gives each its meaning */

#define CALIBRATION_LIST(X) \
    X(torque_slew_Nm_per_s, 0.0F, 1e6F, "Nm/s", "Slew limit of the commanded torque, 0: open") \
    X(observer_m, 2.0F, 4.0F, "", "Pole placement m of the observer") \
    X(flux_bandwidth_rad_s, 0.0F, 500.0F, "rad/s", "Bandwidth of the flux identification") \
    X(resistance_bandwidth_rad_s, 0.0F, 150.0F, "rad/s", "Bandwidth of the resistance identification") \
    X(torque_loop_bandwidth_rad_s, 0.0F, 500.0F, "rad/s", "Bandwidth of the torque loop") \
    X(dead_time_compensation, 0.0F, 1.0F, "", "Compensated share of dead time and device drop")

#endif
