/* SPDX-License-Identifier: Apache-2.0 */
#ifndef HAL_WATCHDOG_H
#define HAL_WATCHDOG_H
/** Windowed watchdog: resets the processor, which disables switching, if it is not serviced within 12 ms, or too early.
 * Source   docs/howto/port.md
 * Units    ms of the watchdog's own clock
 * Errors   none; it cannot be stopped once started
 * Context  1 kHz task, which services it only when the ISRs have advanced */

void hal_watchdog_start(void);
void hal_watchdog_service(void);

#endif
