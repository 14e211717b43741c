/* SPDX-License-Identifier: Apache-2.0 */
#include "hal/s32k144/wdog.h"

#include "hal/s32k144/registers.h"
#include "hal/s32k144/startup.h"
#include "hal/watchdog.h"

#define UNLOCK 0xD928C520U
#define REFRESH 0xB480A602U
#define LPO 1U
#define FIRST_TICKS 12800U /* 100 ms of 128 kHz */
#define TIMEOUT_TICKS 1356U /* 12 ms of the slowest LPO, 113 kHz; 9.5 ms of the fastest */
#define WINDOW_TICKS 50U    /* a service within 0.35 ... 0.44 ms of the last one resets */
#define COMMON (WDOG_CS_CMD32EN | WDOG_CS_CLK(LPO) | WDOG_CS_EN)

/* The three writes must follow the unlocking within 128 bus clocks: no interrupt is enabled yet, or all are masked. */
static void configure(uint32_t window, uint32_t timeout, uint32_t control)
{
    WDOG->CNT = UNLOCK;
    await(&WDOG->CS, WDOG_CS_ULK, WDOG_CS_ULK);
    WDOG->WIN = window;
    WDOG->TOVAL = timeout;
    WDOG->CS = control;
}

/* The configuration takes effect some ticks of the watchdog's clock later, 20 us and more: too long to wait with
 * interrupts masked. */
static void await_configured(void)
{
    await(&WDOG->CS, WDOG_CS_RCS, WDOG_CS_RCS);
}

void wdog_first(void)
{
    configure(0, FIRST_TICKS, COMMON | WDOG_CS_UPDATE);
    await_configured();
}

void hal_watchdog_start(void)
{
    __asm__ volatile("cpsid i" ::: "memory");
    configure(WINDOW_TICKS, TIMEOUT_TICKS, COMMON | WDOG_CS_WIN);
    __asm__ volatile("cpsie i" ::: "memory");
    await_configured();
}

void hal_watchdog_service(void)
{
    WDOG->CNT = REFRESH;
}
