/* SPDX-License-Identifier: Apache-2.0 */
#ifndef HAL_HOST_CALIBRATION_H
#define HAL_HOST_CALIBRATION_H
/** Tuning in SI: turns bandwidths and rates into the fixed-point gains of the drive's own copy of the
 * motor data, and back.
 * Source   docs/theory/mrai.md (MR-7), (MR-9), (MR-10); docs/theory/torque-loop.md (TL-5), (TL-10);
 *          docs/theory/modulation.md (MO-6)
 * Units    stated by each name in hal/host/parameters.c, which also checks the ranges
 * Context  between two periods */
#include "hal/host/fluxtrue.h"

double calibration_get_torque_slew(const fluxtrue_t *drive);
void calibration_set_torque_slew(fluxtrue_t *drive, double value);
double calibration_get_observer_m(const fluxtrue_t *drive);
void calibration_set_observer_m(fluxtrue_t *drive, double value);
double calibration_get_flux_bandwidth(const fluxtrue_t *drive);
void calibration_set_flux_bandwidth(fluxtrue_t *drive, double value);
double calibration_get_resistance_bandwidth(const fluxtrue_t *drive);
void calibration_set_resistance_bandwidth(fluxtrue_t *drive, double value);
double calibration_get_torque_loop(const fluxtrue_t *drive);
void calibration_set_torque_loop(fluxtrue_t *drive, double value);
double calibration_get_dead_time(const fluxtrue_t *drive);
void calibration_set_dead_time(fluxtrue_t *drive, double value);

#endif
