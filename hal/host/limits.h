/* SPDX-License-Identifier: Apache-2.0 */
#ifndef HAL_HOST_LIMITS_H
#define HAL_HOST_LIMITS_H
/** The vehicle's limits, the inverter's temperature, the converters' reading of a known voltage and the monitors that
 * need a machine, in SI, for the names of fluxtrue_set() and fluxtrue_get().
 * Units    N·m, W on the dc side, degrees C
 * Range    not negative; a value from the end of the format on means no limit
 * Errors   none: fluxtrue_set() has checked the range
 * Context  between two steps */
#include "hal/host/fluxtrue.h"

double limits_get_inverter(const fluxtrue_t *drive);
void limits_set_inverter(fluxtrue_t *drive, double value);
double limits_get_known_share(const fluxtrue_t *drive);
void limits_set_known_share(fluxtrue_t *drive, double value);
double limits_get_torque_drive(const fluxtrue_t *drive);
void limits_set_torque_drive(fluxtrue_t *drive, double value);
double limits_get_torque_regen(const fluxtrue_t *drive);
void limits_set_torque_regen(fluxtrue_t *drive, double value);
double limits_get_power_drive(const fluxtrue_t *drive);
void limits_set_power_drive(fluxtrue_t *drive, double value);
double limits_get_power_regen(const fluxtrue_t *drive);
void limits_set_power_regen(fluxtrue_t *drive, double value);
/* 0: the samples do not come from a machine, so control deviation, lost phase, angle and torque are not monitored. */
double limits_get_machine_monitors(const fluxtrue_t *drive);
void limits_set_machine_monitors(fluxtrue_t *drive, double value);

#endif
