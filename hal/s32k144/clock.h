/* SPDX-License-Identifier: Apache-2.0 */
#ifndef HAL_S32K144_CLOCK_H
#define HAL_S32K144_CLOCK_H
/** 112 MHz from an 8 MHz crystal, and the clock gates of the peripherals.
 * Source   README.md, clocks
 * Errors   a clock that does not come, or fails later, resets the processor
 *   clock_slow(): RUN, in which flash commands are allowed: core and PWM timer at 56 MHz. clock_fast(): HSRUN again
 * Context  clock_init(): start-up, once; the others: background, while switching is disabled */
#include <stdint.h>

#define CLOCK_CORE_HZ 112000000U
#define CLOCK_FIRST_HZ 48000000U /* core after clock_first(); ADC, LPSPI: half of it */
#define CLOCK_PERIPHERAL_HZ 28000000U /* SPLLDIV2: ADC, LPIT, LPSPI */

/** The clock gates on the internal oscillator of 48 MHz, which runs from reset on; clock_init() may follow. */
void clock_first(void);
void clock_init(void);
void clock_slow(void);
void clock_fast(void);

#endif
