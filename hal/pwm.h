/* SPDX-License-Identifier: Apache-2.0 */
#ifndef HAL_PWM_H
#define HAL_PWM_H
/** Three-phase bridge: duties for the next period; switching enabled or disabled.
 * Source   docs/howto/port.md
 * Units    duty with 2^15 = 1.0 (0 ... 32768); the port turns it into timer ticks and takes it over synchronously
 * Range    duties 0 ... 32768
 * Errors   none; duties are always in range
 * Context  fast ISR; write() once per period; enable() at a change, and possibly repeatedly: true takes effect
 *          together with the duties written in the same period, false at once.
 *          gates(): fast ISR and 1 kHz task; read back as far as the port can: false while switching is disabled,
 *          and from a gate-driver fault, which the hardware latches, until enable(true) ends the latch */
#include <stdbool.h>

#include "types/samples.h"

void hal_pwm_write(duty_t duty);
void hal_pwm_enable(bool on);
bool hal_pwm_gates(void);

#endif
