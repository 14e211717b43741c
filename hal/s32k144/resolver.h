/* SPDX-License-Identifier: Apache-2.0 */
#ifndef HAL_S32K144_RESOLVER_H
#define HAL_S32K144_RESOLVER_H
/** Velocity measured by the resolver converter.
 * Source   README.md, angle
 * Units    velocity: 2^15 = the largest tracking rate of the resolution (500 turns/s at 14 bits, 8.192 MHz)
 * Context  any; one period old */
#include <stdint.h>

int16_t resolver_velocity(void);

#endif
