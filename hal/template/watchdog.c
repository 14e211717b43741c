/* SPDX-License-Identifier: Apache-2.0 */
#include "hal/watchdog.h"

/* Write: start the windowed watchdog with a time-out of 12 ms at the slowest rate of its clock. */
void hal_watchdog_start(void)
{
}

/* Write: the refresh sequence of the watchdog. */
void hal_watchdog_service(void)
{
}
