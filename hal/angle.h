/* SPDX-License-Identifier: Apache-2.0 */
#ifndef HAL_ANGLE_H
#define HAL_ANGLE_H
/** Mechanical rotor angle at the instant of the current samples.
 * Source   docs/howto/port.md
 * Units    fraction of a mechanical turn, 2^32 = one turn; wraps
 * Range    every angle
 * Errors   none here: the port passes a failure that the sensor reports to drive_raise_fault(); implausible steps are
 *          found by the angle tracker
 * Context  hal_angle_read(): fast ISR, once per period; hal_angle_is_absolute(): 1 kHz task */
#include <stdbool.h>
#include <stdint.h>

uint32_t hal_angle_read(void);
/** Whether the angle is absolute, that is, relative to the shaft's zero. An incremental encoder counts from an unknown
 * angle until its index has passed: speed and direction are right, but torque is refused. Once true it stays true. */
bool hal_angle_is_absolute(void);

#endif
