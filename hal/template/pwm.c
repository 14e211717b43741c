/* SPDX-License-Identifier: Apache-2.0 */
#include "hal/pwm.h"

/* Write: scale the duties (32768 = 100 %) to timer ticks and put them into the buffered compare registers. The timer
 * must take over all three together, at the start of the next period. */
void hal_pwm_write(duty_t duty)
{
    (void)duty;
}

/* Write: true enables the six outputs together with the duties of this period, false disables them at once. */
void hal_pwm_enable(bool on)
{
    (void)on;
}

/* Write: whether the six outputs follow the duties, read from the timer: false while they are disabled, and while the
 * latch of its fault input holds them off. */
bool hal_pwm_gates(void)
{
    return false;
}
