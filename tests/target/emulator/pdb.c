/* SPDX-License-Identifier: Apache-2.0 */
/* Programmable delay block: from one trigger to the converter's pretriggers; back-to-back pretriggers follow the
 * conversion before them. Channel 0 only. */
#include "emu_private.h"

enum { SC = 0x00, MOD = 0x04, CNT = 0x08, IDLY = 0x0C, C1 = 0x10, S = 0x14, DLY0 = 0x18, DLY7 = 0x34 };

static const peripheral_t *of(int instance)
{
    return bus_find(instance == 0 ? "PDB0" : "PDB1");
}

bool pdb_models(uint32_t offset)
{
    return offset <= DLY7;
}

static uint32_t clock_ticks(const emu_t *emu, const peripheral_t *self)
{
    static const uint32_t multiplier[4] = {1, 10, 20, 40};
    const uint32_t sc = bus_get(emu, self, SC);
    return emu->s.core_ticks * multiplier[sc >> 2 & 3U] << (sc >> 12 & 7U);
}

uint32_t pdb_read(emu_t *emu, const peripheral_t *self, uint32_t offset, uint32_t stored)
{
    const pdb_t *p = &emu->s.pdb[self->instance];
    if (offset == CNT) {
        return p->running ? (uint32_t)((emu->s.now - p->start) / clock_ticks(emu, self)) : 0U;
    }
    return stored;
}

static void load(emu_t *emu, const peripheral_t *self)
{
    pdb_t *p = &emu->s.pdb[self->instance];
    p->mod = bus_get(emu, self, MOD);
    p->idly = bus_get(emu, self, IDLY);
    for (uint32_t i = 0; i < 8U; i++) {
        p->dly[i] = bus_get(emu, self, DLY0 + 4U * i);
    }
}

void pdb_written(emu_t *emu, const peripheral_t *self, uint32_t offset, uint32_t old, uint32_t value)
{
    (void)old;
    if (offset == S) {
        bus_put(emu, self, S, old & value); /* flags fall when written 0 */
    }
    if (offset != SC) {
        return;
    }
    const uint32_t source = value >> 8 & 15U;
    if ((value & 0x20022U) != 0 || (value & 1U << 15) != 0) {
        emu_fail(emu, "write of %s.SC: continuous mode, interrupts and DMA are not modelled", self->name);
    }
    if ((value & 0x80U) != 0 && source != 0U && source != 15U) {
        emu_fail(emu, "write of %s.SC: trigger source %u is not connected", self->name, source);
    }
    if ((value & 0x81U) == 0x81U) {
        load(emu, self);
        bus_put(emu, self, SC, value & ~0x10001U);
    }
    if ((value & 0x10080U) == 0x10080U && source == 15U) {
        pdb_trigger(emu, self->instance);
    }
}

/* When the next pretrigger by delay is due; NEVER: none is left. */
static uint64_t next_due(const emu_t *emu, const peripheral_t *self, uint32_t *which)
{
    const pdb_t *p = &emu->s.pdb[self->instance];
    const uint32_t c1 = bus_get(emu, self, C1);
    uint64_t next = NEVER;
    for (uint32_t i = 0; i < 8U; i++) {
        const bool on = (c1 >> i & 1U) != 0, follows = (c1 >> (16U + i) & 1U) != 0;
        const bool delayed = (c1 >> (8U + i) & 1U) != 0;
        if (!on || follows || (p->fired >> i & 1U) != 0) {
            continue;
        }
        const uint64_t due = p->start + (delayed ? (uint64_t)(p->dly[i] + 1U) : 1U) * clock_ticks(emu, self);
        if (due < next) {
            next = due;
            *which = i;
        }
    }
    return next;
}

static void arm(emu_t *emu, const peripheral_t *self)
{
    uint32_t which;
    emu_timer(emu, self->instance == 0 ? TIMER_PDB0 : TIMER_PDB1, next_due(emu, self, &which));
}

void pdb_trigger(emu_t *emu, int instance)
{
    const peripheral_t *self = of(instance);
    pdb_t *p = &emu->s.pdb[instance];
    if ((bus_get(emu, self, SC) & 0x80U) == 0) {
        return;
    }
    if ((bus_get(emu, bus_find("PCC"), self->gate) & 1U << 30) == 0) {
        return;
    }
    p->running = true;
    p->start = emu_instant(emu);
    p->fired = 0;
    arm(emu, self);
}

void pdb_fire(emu_t *emu, int instance)
{
    const peripheral_t *self = of(instance);
    pdb_t *p = &emu->s.pdb[instance];
    uint32_t which = 0;
    while (next_due(emu, self, &which) <= emu_instant(emu)) {
        p->fired |= 1U << which;
        bus_put(emu, self, S, bus_get(emu, self, S) | 1U << (16U + which));
        adc_pretrigger(emu, instance, (int)which);
    }
    arm(emu, self);
}

/* The converter has finished one: the pretrigger behind it, if it waits for that. */
void pdb_acknowledge(emu_t *emu, int instance, int channel)
{
    const peripheral_t *self = of(instance);
    pdb_t *p = &emu->s.pdb[instance];
    const uint32_t next = (uint32_t)channel + 1U, c1 = bus_get(emu, self, C1);
    if (p->running && next < 8U && (c1 >> next & 1U) != 0 && (c1 >> (16U + next) & 1U) != 0) {
        p->fired |= 1U << next;
        bus_put(emu, self, S, bus_get(emu, self, S) | 1U << (16U + next));
        adc_pretrigger(emu, instance, (int)next);
    }
}

void pdb_sequence_error(emu_t *emu, int instance, int channel)
{
    const peripheral_t *self = of(instance);
    bus_put(emu, self, S, bus_get(emu, self, S) | 1U << channel);
}
