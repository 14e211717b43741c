/* SPDX-License-Identifier: Apache-2.0 */
#ifndef HAL_S32K144_ANGLE_H
#define HAL_S32K144_ANGLE_H
/** The angle sensor behind hal/angle.h; one of angle_quadrature.c, angle_resolver.c, angle_as5047.c and angle_sincos.c
 * is linked.
 * Source   README.md, angle
 * Units    period_ticks: one PWM period in ticks of FTM0
 * Errors   angle_fault(): the sensor reports that its angle cannot be trusted; always false for an
 *          incremental encoder
 * Context  angle_init(): start-up, right before the PWM starts; angle_fault(): fast ISR, after hal_angle_read();
 *          angle_follow_index(): the fast ISR's priority, before hal_angle_read() */
#include <stdbool.h>
#include <stdint.h>

void angle_init(uint32_t period_ticks);
/** Magnitude of the mechanical speed in turns per second, on the clock of clock_first(); negative: the sensor reports a
 * fault. Start-up, after pwm_init() and sampling_first_begin(), before angle_init(); takes up to 0.1 ms, a sensor at
 * the converters 0.1 ms after their calibration, and a resolver there 11 periods of its excitation or more. */
float angle_first_speed(void);
bool angle_fault(void);
/** While hal_angle_is_absolute() is false. Once the encoder's index has passed, the next angle is absolute; the result
 * is the part of a turn by which it is larger than the angle from which it counted before. Otherwise 0. */
uint32_t angle_follow_index(void);

#endif
