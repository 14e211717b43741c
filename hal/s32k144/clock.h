/* SPDX-License-Identifier: Apache-2.0 */
#ifndef HAL_S32K144_CLOCK_H
#define HAL_S32K144_CLOCK_H
/** 112 MHz from an 8 MHz crystal, and the clock gates of the peripherals.
 * Source   README.md, clocks
 * Errors   a clock that does not come, or fails later, resets the processor
 * Context  start-up, once */
#include <stdint.h>

#define CLOCK_CORE_HZ 112000000U
#define CLOCK_PERIPHERAL_HZ 28000000U /* SPLLDIV2: ADC, LPIT, LPSPI */

void clock_init(void);

#endif
