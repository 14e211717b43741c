/* SPDX-License-Identifier: Apache-2.0 */
#ifndef HAL_S32K144_PWM_H
#define HAL_S32K144_PWM_H
/** FTM0: three complementary pairs with dead time, and a pulse that makes the resolver converter sample,
 * or excites a resolver.
 * Source   README.md, PWM
 * Units    ticks of 112 MHz
 * Range    pwm_possible(): period_ticks a multiple of 4 up to 65532, dead_time_ticks from 1 to 4092 and an eighth of it
 * Context  pwm_init(), pwm_start(): start-up; pwm_fault_reported(): 1 kHz task;
 *          pwm_gate_fault_isr(): fault interrupt; the timer has already disabled switching. The interrupt's handler
 *          reports the fault to the fast ISR */
#include <stdbool.h>
#include <stdint.h>

typedef struct {
    uint32_t period_ticks;
    uint32_t dead_time_ticks;
} pwm_config_t;

/** Whether the timer can make this period and dead time. Bits beyond its registers would shorten the dead time. */
bool pwm_possible(const pwm_config_t *config);
void pwm_init(const pwm_config_t *config);
/** All lower switches on, at once and without the counter; only before pwm_start(). The counter takes over with the
 * second hal_pwm_enable(true) after its start. */
void pwm_hold_short_circuit(void);
/** The counter runs from here on; its first period starts now. */
void pwm_start(void);
/** A falling edge of SAMPLE, and a low microsecond after it; only before pwm_start(). */
void pwm_sample_by_hand(void);
/** The level of the pulse's output at once, by software; only before pwm_start(). */
void pwm_hold_pulse(bool high);
/** Instead of the pulse of SAMPLE: high between these ticks of each period, by the timer; only before pwm_start(). */
void pwm_pulse(uint32_t from, uint32_t until);
/** Ticks since the start of the period. */
uint32_t pwm_elapsed(void);
void pwm_gate_fault_isr(void);
/** True while the fault input is active, and once after it was active. */
bool pwm_fault_reported(void);

#endif
