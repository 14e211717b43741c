/* SPDX-License-Identifier: Apache-2.0 */
/* Watchdog: runs from reset on, is configured within 128 bus clocks after an unlock, and resets the processor if it is
 * not serviced in time or is serviced in its closed window.
 *
 * documented behaviour                             | modelled | test
 * ------------------------------------------------ | -------- | --------------------------------------------
 * runs from reset, resets after TOVAL              | yes      | test_an_unserviced_watchdog_resets_and_reports_why
 * unlock for 128 bus clocks, then locked           | refused  | test_the_watchdog_locks_again
 * refresh restarts; in the closed window it resets | yes      | test_a_refresh_in_the_closed_window_resets
 * UPDATE 0: not configured again                   | refused  | test_without_update_the_watchdog_stays_configured
 * neither refresh nor unlock                       | refused  | test_what_is_not_modelled_is_an_error
 * interrupt before the reset                       | refused  | test_a_watchdog_interrupt_is_refused
 * tolerance of the LPO, debug and stop modes       | no       | -
 */
#include "emu_private.h"

enum {
    CS = 0x00,
    CNT = 0x04,
    TOVAL = 0x08,
    WIN = 0x0C,
    LPO_TICKS = 26250,
    ACTS_AFTER = 3 * LPO_TICKS,
    OSCILLATOR_TICKS = 420,
    RCM_WDOG = 0x20,
};
#define UNLOCK 0xD928C520U
#define REFRESH 0xB480A602U
#define EN 0x80U
#define UPDATE 0x20U
#define WINDOW 0x8000U
#define PRESCALE 0x1000U

bool wdog_models(uint32_t offset)
{
    (void)offset;
    return true;
}

static bool is_unlocked(const emu_t *emu)
{
    return emu->s.wdog.unlocked && emu->s.now < emu->s.wdog.unlock_end;
}

static uint64_t clock_ticks(const emu_t *emu, const peripheral_t *self)
{
    const uint32_t cs = bus_get(emu, self, CS), source = cs >> 8 & 3U;
    const uint64_t ticks = source == 1U ? LPO_TICKS : source == 0U ? 2U * emu->s.core_ticks : OSCILLATOR_TICKS;
    return ticks * ((cs & PRESCALE) != 0 ? 256U : 1U);
}

uint32_t wdog_read(emu_t *emu, const peripheral_t *self, uint32_t offset, uint32_t stored)
{
    const wdog_t *w = &emu->s.wdog;
    if (offset == CNT) {
        return (uint32_t)((emu->s.now - w->start) / clock_ticks(emu, self)) & 0xFFFFU;
    }
    if (offset == CS) {
        const uint32_t unlocked = is_unlocked(emu) && !w->configured ? 0x800U : 0U;
        return (stored & ~0xC00U) | (w->configured && emu->s.now >= w->acts_from ? 0x400U : 0U) | unlocked;
    }
    return stored;
}

void wdog_restart(emu_t *emu)
{
    const peripheral_t *self = PERIPHERAL(WDOG);
    const bool runs = (bus_get(emu, self, CS) & EN) != 0;
    emu->s.wdog.start = emu->s.now;
    emu_timer(emu, TIMER_WDOG, runs ? emu->s.now + bus_get(emu, self, TOVAL) * clock_ticks(emu, self) : NEVER);
}

void wdog_fire(emu_t *emu)
{
    emu->s.reset_wanted = true;
    emu->s.reset_cause = RCM_WDOG;
    emu->s.stop = true;
}

static void refresh(emu_t *emu, const peripheral_t *self)
{
    const uint64_t passed = (emu->s.now - emu->s.wdog.start) / clock_ticks(emu, self);
    if ((bus_get(emu, self, CS) & WINDOW) != 0 && passed < bus_get(emu, self, WIN)) {
        wdog_fire(emu); /* too early */
    } else {
        wdog_restart(emu);
    }
}

static void count_written(emu_t *emu, const peripheral_t *self, uint32_t value)
{
    if (value == REFRESH) {
        refresh(emu, self);
    } else if (value == UNLOCK) {
        if ((bus_get(emu, self, CS) & UPDATE) == 0 && emu->s.wdog.configured) {
            emu_fail(emu, "write of WDOG.CNT: the watchdog may not be configured again (CS.UPDATE was 0)");
        }
        emu->s.wdog.unlocked = true;
        emu->s.wdog.configured = false;
        emu->s.wdog.unlock_end = emu->s.now + 256ULL * emu->s.core_ticks;
    } else {
        emu_fail(emu, "write of WDOG.CNT: 0x%08x is neither unlock nor refresh", value);
    }
}

void wdog_written(emu_t *emu, const peripheral_t *self, uint32_t offset, uint32_t old, uint32_t value)
{
    (void)old;
    if (offset == CNT) {
        bus_put(emu, self, CNT, 0);
        count_written(emu, self, value);
        return;
    }
    if (!is_unlocked(emu)) {
        emu_fail(emu, "write of WDOG offset 0x%x: the watchdog is locked", offset);
        return;
    }
    if ((bus_get(emu, self, CS) & 0x40U) != 0) {
        emu_fail(emu, "write of WDOG.CS: an interrupt before the reset is not modelled");
    }
    if (offset == CS) {
        emu->s.wdog.configured = true;
        emu->s.wdog.acts_from = emu->s.now + ACTS_AFTER; /* after some ticks of its own clock */
    }
    wdog_restart(emu);
}
