/* SPDX-License-Identifier: Apache-2.0 */
#ifndef HAL_ANGLE_H
#define HAL_ANGLE_H
/** Mechanical rotor angle at the instant of the current samples.
 * Source   docs/howto/port.md
 * Units    fraction of a mechanical turn, 2^32 = one turn; wraps
 * Errors   none here; implausible steps are found by the angle tracker
 * Context  fast ISR, once per period */
#include <stdint.h>

uint32_t hal_angle_read(void);

#endif
