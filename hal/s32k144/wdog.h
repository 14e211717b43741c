/* SPDX-License-Identifier: Apache-2.0 */
#ifndef HAL_S32K144_WDOG_H
#define HAL_S32K144_WDOG_H
/** The watchdog's first configuration, which must come first: after a reset it expires in 8 ms.
 * Source   README.md, watchdog
 * Context  start-up, before .data and .bss exist */

/** 100 ms without a window, and still configurable: enough for the start-up. */
void wdog_first(void);

#endif
