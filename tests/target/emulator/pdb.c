/* SPDX-License-Identifier: Apache-2.0 */
/* Programmable delay block: a trigger starts the converter's pre-triggers, each after its delay. Channel 0 only.
 *
 * A pre-trigger that starts a conversion takes a lock; while any lock of the channel is held, a further pre-trigger
 * starts nothing and sets its sequence error. A lock is released when the conversion's COCO rises, when the
 * pre-trigger is disabled or when the PDB is disabled. COCO rises only if it was clear: a result that was not read
 * before the next conversion into the same register leaves the lock held. Whether reading that result late would
 * release it is not documented; here it does not.
 *
 * documented behaviour                               | modelled | test
 * -------------------------------------------------- | -------- | ---------------------------------------------------
 * counter, MULT, PRESCALER, delays up to MOD         | yes      | test_a_delay_counts_from_the_trigger
 * a delay beyond MOD never triggers                  | yes      | test_a_delay_beyond_the_modulus_never_triggers
 * registers act after LDOK (LDMOD 0)                 | yes      | test_a_delay_acts_only_after_it_was_loaded
 * pre-trigger 2 cycles after its cause, trigger 3    | yes      | test_a_delay_counts_from_the_trigger
 * back-to-back: starts when the COCO before it rises | yes      | test_back_to_back_conversions_follow_at_once
 * lock until COCO rises; sequence error meanwhile    | yes      | test_an_unread_result_stops_the_sequence
 * disabling PDB or pre-trigger releases locks        | yes      | test_disabling_releases_the_locks
 * sequence error interrupt, flags cleared by zeros   | yes      | test_a_sequence_error_interrupts_until_it_is_cleared
 * LDMOD 1 ... 3, CONT, PDBIE, DMAEN, other triggers  | refused  | test_other_modes_of_the_delay_block_are_refused
 * pulse output 0 rises at DLY1 and falls at DLY2     | yes      | test_a_request_starts_one_frame_per_pulse
 * channel 1, other pulse outputs, a pulse beyond MOD | refused  | test_channel_1_and_other_pulses_are_refused
 */
#include "emu_private.h"

enum {
    SC = 0x00,
    MOD = 0x04,
    CNT = 0x08,
    IDLY = 0x0C,
    C1 = 0x10,
    S = 0x14,
    DLY0 = 0x18,
    DLY7 = 0x34,
    POEN = 0x190,
    PODLY = 0x194,
    PRETRIGGERS = 8,
    PULSE_UP = PRETRIGGERS,
    PULSE_DOWN = 9,
    OUTPUTS = 10,
    PULSE0 = 36, /* number of the pulse output in TRGMUX; the one of PDB1 is three more */
    PRETRIGGER_CYCLES = 2,
    TRIGGER_CYCLES = 1,
    PDB0_IRQ = 52,
    PDB1_IRQ = 68,
    LDOK = 1 << 0,
    PDBEN = 1 << 7,
    SWTRIG = 1 << 16,
    PDBEIE = 1 << 17,
    ERRORS = 0xFF,
    FLAG0 = 16,
    NOT_MODELLED = 1 << 1 | 1 << 5 | 1 << 15 | 3 << 18, /* CONT, PDBIE, DMAEN, LDMOD */
};

static const peripheral_t *of(int instance)
{
    return instance == 0 ? PERIPHERAL(PDB0) : PERIPHERAL(PDB1);
}

bool pdb_models(uint32_t offset)
{
    return offset <= DLY7 || offset == POEN || offset == PODLY;
}

void pdb_reset(emu_t *emu)
{
    for (int instance = 0; instance < 2; instance++) {
        for (uint32_t i = 0; i < OUTPUTS; i++) {
            emu->s.pdb[instance].due[i] = NEVER;
        }
    }
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
        const uint64_t counted = p->running ? (emu->s.now - p->start) / clock_ticks(emu, self) : 0U;
        return counted <= p->mod ? (uint32_t)counted : 0U; /* one shot: the counter returns to zero after MOD */
    }
    return stored;
}

static void line_update(emu_t *emu, const peripheral_t *self)
{
    const bool error = (bus_get(emu, self, S) & ERRORS) != 0 && (bus_get(emu, self, SC) & PDBEIE) != 0;
    nvic_line(emu, self->instance == 0 ? PDB0_IRQ : PDB1_IRQ, error);
}

static void load(emu_t *emu, const peripheral_t *self)
{
    pdb_t *p = &emu->s.pdb[self->instance];
    p->mod = bus_get(emu, self, MOD);
    p->idly = bus_get(emu, self, IDLY);
    for (uint32_t i = 0; i < PRETRIGGERS; i++) {
        p->dly[i] = bus_get(emu, self, DLY0 + 4U * i);
    }
    p->pulse_up = bus_get(emu, self, PODLY) >> 16;
    p->pulse_down = bus_get(emu, self, PODLY) & 0xFFFFU;
}

/* When the next trigger output is due; NEVER: none is left. */
static uint64_t next_due(const pdb_t *p, uint32_t *which)
{
    uint64_t next = NEVER;
    for (uint32_t i = 0; i < OUTPUTS; i++) {
        if (p->due[i] < next) {
            next = p->due[i];
            *which = i;
        }
    }
    return next;
}

static void arm(emu_t *emu, int instance)
{
    uint32_t which;
    emu_timer(emu, instance == 0 ? TIMER_PDB0 : TIMER_PDB1, next_due(&emu->s.pdb[instance], &which));
}

/* Disabled pre-triggers neither start conversions nor hold a lock; without PDBEN all of them are disabled. */
static void disable(emu_t *emu, const peripheral_t *self, uint32_t pretriggers)
{
    pdb_t *p = &emu->s.pdb[self->instance];
    p->locked &= ~pretriggers;
    for (uint32_t i = 0; i < PRETRIGGERS; i++) {
        p->due[i] = (pretriggers >> i & 1U) != 0 ? NEVER : p->due[i];
    }
    arm(emu, self->instance);
}

static void pulse(emu_t *emu, int instance, bool level)
{
    trgmux_level(emu, PULSE0 + (instance == 0 ? 0U : 3U), level);
}

/* A pulse that has begun ends as if the block were still enabled. */
static void pulse_stop(emu_t *emu, int instance)
{
    pdb_t *p = &emu->s.pdb[instance];
    if (p->due[PULSE_UP] != NEVER) {
        p->due[PULSE_UP] = p->due[PULSE_DOWN] = NEVER;
    }
}

static void pulse_start(emu_t *emu, const peripheral_t *self)
{
    pdb_t *p = &emu->s.pdb[self->instance];
    if ((bus_get(emu, self, POEN) & 1U) == 0) {
        return;
    }
    if (p->pulse_up >= p->pulse_down || p->pulse_down > p->mod) {
        emu_fail(emu, "%s: a pulse from %u to %u with MOD %u is not modelled", self->name, p->pulse_up, p->pulse_down,
                 p->mod);
    }
    p->due[PULSE_UP] = p->start + (uint64_t)p->pulse_up * clock_ticks(emu, self);
    p->due[PULSE_DOWN] = p->start + (uint64_t)p->pulse_down * clock_ticks(emu, self);
}

static void control_written(emu_t *emu, const peripheral_t *self, uint32_t value)
{
    const uint32_t source = value >> 8 & 15U;
    if ((value & NOT_MODELLED) != 0) {
        emu_fail(emu, "write of %s.SC: CONT, PDBIE, DMAEN and LDMOD are not modelled", self->name);
    }
    if ((value & PDBEN) != 0 && source != 0U && source != 15U) {
        emu_fail(emu, "write of %s.SC: trigger source %u is not connected", self->name, source);
    }
    if ((value & PDBEN) == 0) {
        emu->s.pdb[self->instance].running = false;
        pulse_stop(emu, self->instance);
        disable(emu, self, ERRORS);
    }
    if ((value & (PDBEN | LDOK)) == (PDBEN | LDOK)) {
        load(emu, self);
    }
    bus_put(emu, self, SC, value & ~(uint32_t)(LDOK | SWTRIG));
    line_update(emu, self);
    if ((value & (SWTRIG | PDBEN)) == (SWTRIG | PDBEN) && source == 15U) {
        pdb_trigger(emu, self->instance);
    }
}

void pdb_written(emu_t *emu, const peripheral_t *self, uint32_t offset, uint32_t old, uint32_t value)
{
    if (offset == S) {
        bus_put(emu, self, S, old & value); /* writing 0 clears a flag */
        line_update(emu, self);
    } else if (offset == C1) {
        disable(emu, self, ~value & ERRORS);
    } else if (offset == POEN && (value & ~1U) != 0) {
        emu_fail(emu, "write of %s.POEN: only pulse output 0 is modelled", self->name);
    } else if (offset == SC) {
        control_written(emu, self, value);
    }
}

static uint64_t output_delay(const emu_t *emu)
{
    return (uint64_t)(PRETRIGGER_CYCLES + TRIGGER_CYCLES) * emu->s.core_ticks;
}

void pdb_trigger(emu_t *emu, int instance)
{
    const peripheral_t *self = of(instance);
    pdb_t *p = &emu->s.pdb[instance];
    const uint32_t c1 = bus_get(emu, self, C1);
    if ((bus_get(emu, self, SC) & PDBEN) == 0 || (bus_get(emu, PERIPHERAL(PCC), self->gate) & 1U << 30) == 0) {
        return;
    }
    p->running = true;
    p->start = emu_instant(emu);
    for (uint32_t i = 0; i < PRETRIGGERS; i++) {
        const uint32_t delay = (c1 >> (8U + i) & 1U) != 0 ? p->dly[i] : 0U;
        if ((c1 >> i & 1U) != 0 && (c1 >> (16U + i) & 1U) == 0 && delay <= p->mod) {
            p->due[i] = p->start + (uint64_t)delay * clock_ticks(emu, self) + output_delay(emu);
        }
    }
    pulse_start(emu, self);
    arm(emu, instance);
}

static void pretrigger(emu_t *emu, const peripheral_t *self, uint32_t which)
{
    pdb_t *p = &emu->s.pdb[self->instance];
    uint32_t flags = bus_get(emu, self, S) | 1U << (FLAG0 + which);
    if (p->locked != 0) {
        flags |= 1U << which;
    } else if (adc_pretrigger(emu, self->instance, (int)which)) {
        p->locked = 1U << which;
    }
    bus_put(emu, self, S, flags);
    line_update(emu, self);
}

void pdb_fire(emu_t *emu, int instance)
{
    pdb_t *p = &emu->s.pdb[instance];
    uint32_t which = 0;
    while (next_due(p, &which) <= emu_instant(emu)) {
        p->due[which] = NEVER;
        if (which < PRETRIGGERS) {
            pretrigger(emu, of(instance), which);
        } else {
            pulse(emu, instance, which == PULSE_UP);
        }
    }
    arm(emu, instance);
}

/* COCO has risen: the lock is released, and the next pre-trigger follows if it is in back-to-back mode. */
void pdb_acknowledge(emu_t *emu, int instance, int channel)
{
    const peripheral_t *self = of(instance);
    pdb_t *p = &emu->s.pdb[instance];
    const uint32_t next = (uint32_t)channel + 1U, c1 = bus_get(emu, self, C1);
    p->locked &= ~(1U << channel);
    if ((bus_get(emu, self, SC) & PDBEN) != 0 && next < PRETRIGGERS && (c1 >> next & 1U) != 0 &&
        (c1 >> (16U + next) & 1U) != 0) {
        p->due[next] = emu_instant(emu) + output_delay(emu);
        arm(emu, instance);
    }
}
