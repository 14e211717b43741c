/* SPDX-License-Identifier: Apache-2.0 */
#ifndef HAL_S32K144_ANGLE_H
#define HAL_S32K144_ANGLE_H
/** The angle sensor behind hal/angle.h; one of angle_quadrature.c and angle_resolver.c is linked.
 * Source   README.md, angle
 * Errors   angle_fault(): the sensor reports that its angle cannot be trusted; always false for an encoder
 * Context  angle_init(): start-up; the others: fast ISR, angle_begin() first thing, angle_end() last */
#include <stdbool.h>

void angle_init(void);
void angle_begin(void);
void angle_end(void);
bool angle_fault(void);

#endif
