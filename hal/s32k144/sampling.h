/* SPDX-License-Identifier: Apache-2.0 */
#ifndef HAL_S32K144_SAMPLING_H
#define HAL_S32K144_SAMPLING_H
/** Both converters, started by the PWM's period through the delay blocks: phase currents and dc voltage at the start of
 * the period, temperatures and the bandgap in its middle. With ANGLE_BY_ADC sine and cosine of an analogue angle sensor
 * follow the currents, both at the same instant.
 * Source   README.md, sampling
 * Units    12-bit counts; period_ticks: ticks of 112 MHz
 * Range    period_ticks up to 65535
 * Errors   a sequence error (a conversion was asked for while a lock was held) loses the samples of up to
 *          three periods; its interrupt restarts the delay block
 * Context  sampling_init(), sampling_pulse(): start-up, before the PWM starts; sampling_error_isr(): both delay blocks'
 *          interrupts, at the fast ISR's priority; sampling_tick() and the slow channels, as converted last: 1 kHz
 *          task; sampling_angle(): fast ISR, in every period, or its pre-triggers stay locked;
 *          sampling_first_*(): start-up, before sampling_init(), on the clock of clock_first() */
#include <stdbool.h>
#include <stdint.h>

#include "hal/s32k144/registers.h"

typedef struct {
    uint32_t sine, cosine;
} angle_counts_t;

enum { SAMPLING_ANGLE = 2 }; /* conversion of sine and cosine in the sequence of each converter */
/* When they are sampled, in ticks of 112 MHz from the start of the period: each of the three conversions is started 3
 * ticks after its cause, the first two take 38 clocks of 4 ticks, and the third samples for 8. */
#define SAMPLING_ANGLE_TICKS (3U * 3U + 2U * 38U * 4U + 8U * 4U)

void sampling_init(uint32_t period_ticks);
/** Both converters begin their calibration, and have ended it after sampling_first_end(), which may be called again. */
void sampling_first_begin(void);
bool sampling_first_calibrates(void);
void sampling_first_end(void);
/** After the calibration: the dc voltage; sine and cosine together; each converted at once, any number of times. */
uint16_t sampling_first_v_dc(void);
angle_counts_t sampling_first_angle(void);
/** Those of this period. */
static inline angle_counts_t sampling_angle(void)
{
    return (angle_counts_t){ADC0->R[SAMPLING_ANGLE], ADC1->R[SAMPLING_ANGLE]};
}
/** From the next period on: a level for the trigger multiplexer, from and until these ticks of each period; both lie in
 * its first half. */
void sampling_pulse(uint32_t from, uint32_t until);
/** True: the errors persist (five, less than 10 ms apart), and the caller must bring the drive into its safe state. */
bool sampling_error_isr(void);
void sampling_tick(void);

uint16_t sampling_winding(void);
uint16_t sampling_inverter(void);
uint16_t sampling_die(void);

#endif
