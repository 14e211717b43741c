/* SPDX-License-Identifier: Apache-2.0 */
/* Low-power interrupt timer: periodic channels. A value written while a channel runs acts after its next expiry.
 *
 * documented behaviour                            | modelled | test
 * ----------------------------------------------- | -------- | --------------------------------------------
 * a channel expires every TVAL + 1 clocks         | yes      | test_a_channel_expires_periodically
 * a value written meanwhile acts after the expiry | yes      | test_a_new_value_acts_after_the_next_expiry
 * TIF, cleared by a one; interrupt with TIE       | yes      | test_a_channel_expires_periodically
 * four clocks between M_CEN and other writes      | refused  | test_what_is_not_modelled_is_an_error
 * other modes, chains, triggers, SETTEN, CLRTEN   | refused  | test_other_channel_modes_are_refused
 */
#include "emu_private.h"

enum {
    MCR = 0x08,
    MSR = 0x0C,
    MIER = 0x10,
    SETTEN = 0x14,
    CLRTEN = 0x18,
    TVAL0 = 0x20,
    CVAL0 = 0x24,
    TCTRL0 = 0x28,
    STEP = 0x10,
    CHANNELS = 4,
    LPIT_IRQ = 48,
};

bool lpit_models(uint32_t offset)
{
    return offset < TVAL0 + STEP * CHANNELS;
}

static uint32_t clock_ticks(emu_t *emu, const peripheral_t *self)
{
    const uint32_t ticks = clocks_peripheral_ticks(emu, self->gate);
    if (ticks == 0) {
        emu_fail(emu, "LPIT0 runs without a clock (PCC, SCG divider 2)");
    }
    return ticks == 0 ? 1U : ticks;
}

uint32_t lpit_read(emu_t *emu, const peripheral_t *self, uint32_t offset, uint32_t stored)
{
    if (offset >= CVAL0 && (offset - CVAL0) % STEP == 0) {
        const uint64_t due = emu->s.due[TIMER_LPIT0 + (offset - CVAL0) / STEP];
        const uint64_t left = due > emu->s.now ? due - emu->s.now : 0U;
        return due == NEVER ? 0xFFFFFFFFU : (uint32_t)(left / clock_ticks(emu, self));
    }
    return stored;
}

static void lines_update(emu_t *emu, const peripheral_t *self)
{
    const uint32_t raised = bus_get(emu, self, MSR) & bus_get(emu, self, MIER);
    for (int i = 0; i < CHANNELS; i++) {
        nvic_line(emu, LPIT_IRQ + i, (raised >> i & 1U) != 0);
    }
}

static void start(emu_t *emu, const peripheral_t *self, uint32_t channel)
{
    const uint32_t value = bus_get(emu, self, TVAL0 + STEP * channel);
    const uint64_t due = emu_instant(emu) + ((uint64_t)value + 1U) * clock_ticks(emu, self);
    emu_timer(emu, (timer_t_)(TIMER_LPIT0 + channel), due);
}

static void control_written(emu_t *emu, const peripheral_t *self, uint32_t channel, uint32_t old, uint32_t value)
{
    if ((value & ~1U) != 0) {
        emu_fail(emu, "write of LPIT0.TCTRL%u: only periodic counting is modelled", channel);
    } else if ((value & ~old & 1U) != 0) {
        start(emu, self, channel);
    } else if ((value & 1U) == 0) {
        emu_timer(emu, (timer_t_)(TIMER_LPIT0 + channel), NEVER);
    }
}

void lpit_written(emu_t *emu, const peripheral_t *self, uint32_t offset, uint32_t old, uint32_t value)
{
    if (offset == MCR) {
        emu->s.lpit_ready = (value & 1U) != 0 ? emu->s.now + 4ULL * clock_ticks(emu, self) : NEVER;
        return;
    }
    if ((bus_get(emu, self, MCR) & 1U) == 0 || emu->s.now < emu->s.lpit_ready) {
        emu_fail(emu, "write of LPIT0 offset 0x%x: the module was not enabled four clocks before (MCR.M_CEN)", offset);
    }
    if (offset == MSR) {
        bus_put(emu, self, MSR, old & ~value);
    } else if (offset == SETTEN || offset == CLRTEN) {
        emu_fail(emu, "write of LPIT0.%s: not modelled", offset == SETTEN ? "SETTEN" : "CLRTEN");
    } else if (offset >= TCTRL0 && (offset - TCTRL0) % STEP == 0) {
        control_written(emu, self, (offset - TCTRL0) / STEP, old, value);
    }
    lines_update(emu, self);
}

void lpit_fire(emu_t *emu, int channel)
{
    const peripheral_t *self = PERIPHERAL(LPIT0);
    bus_put(emu, self, MSR, bus_get(emu, self, MSR) | 1U << channel);
    start(emu, self, (uint32_t)channel);
    lines_update(emu, self);
}
