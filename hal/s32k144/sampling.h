/* SPDX-License-Identifier: Apache-2.0 */
#ifndef HAL_S32K144_SAMPLING_H
#define HAL_S32K144_SAMPLING_H
/** Both converters, started by the PWM's period through the delay blocks.
 * Source   README.md, sampling
 * Units    12-bit counts
 * Context  sampling_init(): start-up, before the PWM starts; the slow channels: 1 kHz task, as converted last */
#include <stdint.h>

void sampling_init(void);

uint16_t sampling_winding(void);
uint16_t sampling_inverter(void);
uint16_t sampling_die(void);

#endif
