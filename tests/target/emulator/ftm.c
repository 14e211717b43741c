/* SPDX-License-Identifier: Apache-2.0 */
/* FlexTimer: FTM0 as the bridge's modulator (up counting, combined complementary pairs with dead time, buffered and
 * synchronised compare values, output mask, software output control, fault input), FTM2 as quadrature decoder. */
#include "emu_private.h"

enum {
    SC = 0x00, CNT = 0x04, MOD = 0x08, C0SC = 0x0C, C0V = 0x10, C7V = 0x48, CNTIN = 0x4C, STATUS = 0x50, MODE = 0x54,
    SYNC = 0x58, OUTINIT = 0x5C, OUTMASK = 0x60, COMBINE = 0x64, DEADTIME = 0x68, EXTTRIG = 0x6C, POL = 0x70,
    FMS = 0x74, FILTER = 0x78, FLTCTRL = 0x7C, QDCTRL = 0x80, CONF = 0x84, FLTPOL = 0x88, SYNCONF = 0x8C,
    SWOCTRL = 0x94, LAST = 0x98,
    FTM0_FAULT_IRQ = 103, FTM0_OVERFLOW_IRQ = 104, INIT_TRIGGER = 22,
    PAIR_COMBINE = 1, PAIR_COMP = 2, PAIR_DTEN = 16, PAIR_SYNCEN = 32, PAIR_FAULTEN = 64,
};

static const peripheral_t *ftm0(void)
{
    return bus_find("FTM0");
}

static const peripheral_t *of(int instance)
{
    return bus_find(instance == 0 ? "FTM0" : "FTM2");
}

bool ftm_models(uint32_t offset)
{
    return offset < LAST && offset != 0x90U;
}

static uint32_t clock_ticks(const emu_t *emu, const peripheral_t *self)
{
    const uint32_t sc = bus_get(emu, self, SC);
    return (sc >> 3 & 3U) == 1U ? emu->s.core_ticks << (sc & 7U) : 0U;
}

static uint64_t period_ticks(const emu_t *emu, const peripheral_t *self)
{
    const ftm_t *f = &emu->s.ftm[self->instance];
    return (uint64_t)(f->mod - f->cntin + 1U) * clock_ticks(emu, self);
}

static bool decoding(const emu_t *emu, const peripheral_t *self)
{
    return (bus_get(emu, self, QDCTRL) & 1U) != 0;
}

/* The encoder has as many edges per turn as the counter has values. */
static uint32_t decoded(const emu_t *emu, const peripheral_t *self)
{
    const uint64_t counts = (uint64_t)bus_get(emu, self, MOD) + 1U;
    const uint32_t at = (uint32_t)((emu_angle(emu) * counts) >> 32);
    return (uint32_t)((at + emu->s.ftm[self->instance].quad_offset) % counts);
}

/* ---- registers ---- */

static uint32_t fault_status(const emu_t *emu, const peripheral_t *self)
{
    const uint32_t kept = bus_get(emu, self, FMS) & 0x40U;
    const bool latched = emu->s.ftm[self->instance].fault_latched;
    return kept | (emu->s.pins.gate_fault ? 0x20U : 0U) | (latched ? 0x81U : 0U);
}

static uint32_t counter(const emu_t *emu, const peripheral_t *self, uint32_t stored)
{
    const ftm_t *f = &emu->s.ftm[self->instance];
    if (decoding(emu, self)) {
        return decoded(emu, self);
    }
    return f->running ? f->cntin + (uint32_t)((emu->s.now - f->start) / clock_ticks(emu, self)) : stored;
}

uint32_t ftm_read(emu_t *emu, const peripheral_t *self, uint32_t offset, uint32_t stored)
{
    ftm_t *f = &emu->s.ftm[self->instance];
    switch (offset) {
    case CNT:
        f->read[1] = f->read[0];
        f->read[0] = counter(emu, self, stored);
        return f->read[0];
    case SC: return (stored & ~0x280U) | (f->tof ? 0x200U : 0U);
    case FMS:
        f->fault_seen = f->fault_latched;
        return fault_status(emu, self);
    default: return stored;
    }
}

/* The counter is at CNTIN and runs: emu_run() returns, so that the pins can be given this instant's values. */
static void period_begins(emu_t *emu, const peripheral_t *self)
{
    if (self->instance == 0) {
        emu->s.ftm[0].triggers_due = true;
        emu->s.centre = true;
        emu->s.stop = true;
    }
}

static void start_or_stop(emu_t *emu, const peripheral_t *self)
{
    ftm_t *f = &emu->s.ftm[self->instance];
    const bool wanted = clock_ticks(emu, self) != 0 && !decoding(emu, self);
    if (clock_ticks(emu, self) != 0 && !f->running) {
        pins_check(emu, self->name);
    }
    if (wanted && !f->running) {
        f->running = true;
        f->start = emu->s.now;
        period_begins(emu, self);
        emu_timer(emu, self->instance == 0 ? TIMER_FTM0 : TIMER_FTM2, emu->s.now + period_ticks(emu, self));
    } else if (!wanted) {
        f->running = false;
        emu_timer(emu, self->instance == 0 ? TIMER_FTM0 : TIMER_FTM2, NEVER);
    }
}

static void buffers_load(emu_t *emu, const peripheral_t *self, bool synchronised)
{
    ftm_t *f = &emu->s.ftm[self->instance];
    const uint32_t combine = bus_get(emu, self, COMBINE);
    for (uint32_t channel = 0; channel < 8U; channel++) {
        const bool waits = (combine >> (8U * (channel / 2U)) & PAIR_SYNCEN) != 0;
        if (synchronised || !waits) {
            f->cv[channel] = bus_get(emu, self, C0V + 8U * channel);
        }
    }
    if (synchronised) {
        f->mod = bus_get(emu, self, MOD);
        f->cntin = bus_get(emu, self, CNTIN);
    }
}

static void sync_written(emu_t *emu, const peripheral_t *self, uint32_t value)
{
    ftm_t *f = &emu->s.ftm[self->instance];
    const uint32_t conf = bus_get(emu, self, SYNCONF);
    if ((value & 0x80U) == 0) { /* SWSYNC */
        return;
    }
    if ((conf & 0x80U) == 0) {
        emu_fail(emu, "write of %s.SYNC: a software trigger with SYNCONF.SYNCMODE = 0 is not modelled", self->name);
    }
    f->software_trigger = f->software_trigger || (conf & 1U << 9) != 0;
    if ((conf & 1U << 10) != 0 && (value & 8U) != 0) {
        f->outmask = bus_get(emu, self, OUTMASK);
    }
}

static void mode_written(emu_t *emu, const peripheral_t *self, uint32_t value)
{
    if (self->instance == 0 && (value & 1U) == 0 && emu->s.ftm[0].running) {
        emu_fail(emu, "write of FTM0.MODE: without FTMEN the outputs are not modelled");
    }
}

/* FAULTF falls when it is read as 1 and then written 0 while the input is quiet again. */
static void fms_written(emu_t *emu, const peripheral_t *self, uint32_t value)
{
    ftm_t *f = &emu->s.ftm[self->instance];
    if ((value & 0x80U) == 0 && !emu->s.pins.gate_fault && f->fault_seen) {
        f->fault_seen = false;
        f->fault_latched = false;
        nvic_line(emu, FTM0_FAULT_IRQ, false);
    }
    if ((value & 0x40U) != 0) {
        bus_put(emu, self, MODE, bus_get(emu, self, MODE) & ~4U); /* WPDIS is its negation */
    }
}

/* Bits that the reference manual calls write protected. */
static uint32_t protected_bits(uint32_t offset)
{
    switch (offset) {
    case SC: return 0x3FU;                          /* CPWMS, CLKS, PS */
    case MODE: return 0x79U;                        /* FTMEN, PWMSYNC, CAPTEST, FAULTM */
    case COMBINE: return 0x57575757U;               /* all but DECAP, SYNCEN, MCOMBINE */
    case FLTCTRL: return 0xFFU;
    case QDCTRL: return 1U;
    case DEADTIME: case POL: case FLTPOL: return 0xFFFFFFFFU;
    default: return offset >= C0SC && offset < C7V && (offset - C0SC) % 8U == 0 ? 0x3CU : 0U;
    }
}

static void check_protection(emu_t *emu, const peripheral_t *self, uint32_t offset, uint32_t old, uint32_t value)
{
    const uint32_t changed = (old ^ value) & protected_bits(offset);
    if (changed != 0 && (bus_get(emu, self, FMS) & 0x40U) != 0) {
        emu_fail(emu, "write of %s offset 0x%x: the bits 0x%x are write protected (FMS.WPEN) and keep their values",
                 self->name, offset, changed);
    }
}

/* The plant takes one state of the bridge per period: it may open within one, but not close. */
static void check_bridge(emu_t *emu, const peripheral_t *self, uint32_t offset, uint32_t old)
{
    if (self->instance != 0 || (offset != SC && offset != OUTMASK && offset != SWOCTRL && offset != FMS)) {
        return;
    }
    emu_bridge_t now;
    emu_bridge(emu, &now);
    if (now.gates && !emu->s.ftm[0].closed) {
        emu_fail(emu, "write of FTM0 offset 0x%x (0x%x before): the bridge closes in the middle of a period", offset,
                 old);
    }
    emu->s.ftm[0].closed = now.gates;
}

/* SAMPLE of the resolver converter is channel 6: low from the period's start to C6V, high from there on. */
static bool sample_falls(const emu_t *emu)
{
    const peripheral_t *self = ftm0();
    const ftm_t *f = &emu->s.ftm[0];
    return (bus_get(emu, self, SC) >> 22 & 1U) != 0 && (bus_get(emu, self, SWOCTRL) >> 6 & 1U) == 0 &&
           (bus_get(emu, self, COMBINE) >> 24 & PAIR_COMBINE) != 0 && (bus_get(emu, self, C0SC + 48U) & 12U) == 8U &&
           f->cv[6] > f->cntin && f->cv[7] > f->mod;
}

/* While software holds the line: what it is held at. */
static void sample_held(emu_t *emu, uint32_t forced)
{
    const bool high = (forced >> 6 & 1U) != 0 && (forced >> 14 & 1U) != 0;
    if (emu->s.rdc.high && !high) {
        rdc_sample(emu);
    }
    emu->s.rdc.high = high;
}

static void act(emu_t *emu, const peripheral_t *self, uint32_t offset, uint32_t value)
{
    ftm_t *f = &emu->s.ftm[self->instance];
    if (offset == SC) {
        f->tof = f->tof && (value & 0x200U) != 0;
        start_or_stop(emu, self);
        if ((value & 0x20U) != 0 || (value & 0x140U) != 0) {
            emu_fail(emu, "write of %s.SC: up-down counting and its interrupts are not modelled", self->name);
        }
    } else if (offset == CNT && !decoding(emu, self)) {
        bus_put(emu, self, CNT, bus_get(emu, self, CNTIN));
        if (self->instance == 0 && (bus_get(emu, self, EXTTRIG) & 0x40U) != 0) {
            trgmux_event(emu, INIT_TRIGGER); /* a write of the counter is an initialisation, too */
        }
    } else if (offset == CNT) {
        f->quad_offset = 0;
        f->quad_offset = bus_get(emu, self, CNTIN) + bus_get(emu, self, MOD) + 1U - decoded(emu, self);
    } else if (offset == OUTMASK && (bus_get(emu, self, SYNC) & 8U) == 0) {
        f->outmask = value;
    } else if (offset == SYNC) {
        sync_written(emu, self, value);
    } else if (offset == SWOCTRL && self->instance == 0) {
        sample_held(emu, value);
    } else if (offset == MODE) {
        mode_written(emu, self, value);
    } else if (offset == FMS) {
        fms_written(emu, self, value);
    } else if (offset == QDCTRL) {
        start_or_stop(emu, self);
    } else if (offset == FLTCTRL || offset == FLTPOL) {
        ftm_fault_input(emu);
    }
    if (!f->running) {
        buffers_load(emu, self, true);
    }
}

void ftm_written(emu_t *emu, const peripheral_t *self, uint32_t offset, uint32_t old, uint32_t value)
{
    check_protection(emu, self, offset, old, value);
    act(emu, self, offset, value);
    check_bridge(emu, self, offset, old);
}

/* ---- events ---- */

void ftm_fault_input(emu_t *emu)
{
    const peripheral_t *self = ftm0();
    ftm_t *f = &emu->s.ftm[0];
    const bool listens = (bus_get(emu, self, FLTCTRL) & 1U) != 0 && (bus_get(emu, self, MODE) & 0x60U) != 0;
    if (listens && emu->s.pins.gate_fault && !f->fault_latched) {
        f->fault_latched = true;
        f->fault_seen = false;
        nvic_line(emu, FTM0_FAULT_IRQ, (bus_get(emu, self, MODE) & 0x80U) != 0);
    }
}

/* The hardware trigger that TRGMUX gives to FTM0, from its own start: with HWOM it takes over the output mask. */
static void hardware_trigger(emu_t *emu)
{
    const peripheral_t *self = ftm0();
    const uint32_t sync = bus_get(emu, self, SYNC), conf = bus_get(emu, self, SYNCONF);
    const bool connected = (bus_get(emu, bus_find("TRGMUX"), 0x28) & 0x3FU) == INIT_TRIGGER;
    if (!connected || (sync & 0x10U) == 0) {
        return;
    }
    if ((conf & 1U << 18) != 0 && (sync & 8U) != 0) {
        emu->s.ftm[0].outmask = bus_get(emu, self, OUTMASK);
    }
    if ((conf & 1U << 17) != 0) {
        emu->s.ftm[0].software_trigger = true;
    }
    if ((conf & 1U) == 0) {
        bus_put(emu, self, SYNC, sync & ~0x10U);
    }
}

static void closed_update(emu_t *emu)
{
    emu_bridge_t bridge;
    emu_bridge(emu, &bridge);
    emu->s.ftm[0].closed = bridge.gates;
}

/* The counter goes from MOD to CNTIN: the loading point (SYNC.CNTMAX), and the period's begin. */
void ftm_fire(emu_t *emu, int instance)
{
    const peripheral_t *self = of(instance);
    ftm_t *f = &emu->s.ftm[instance];
    const uint32_t sync = bus_get(emu, self, SYNC);
    f->start = emu_instant(emu);
    f->tof = true;
    buffers_load(emu, self, f->software_trigger && (sync & 2U) != 0);
    if (f->software_trigger && (sync & 2U) != 0) {
        f->software_trigger = false;
        bus_put(emu, self, SYNC, sync & ~0x80U);
    }
    emu_timer(emu, instance == 0 ? TIMER_FTM0 : TIMER_FTM2, f->start + period_ticks(emu, self));
    if (instance == 0) {
        if ((bus_get(emu, self, EXTTRIG) & 0x40U) != 0) {
            hardware_trigger(emu);
        }
        closed_update(emu);
        period_begins(emu, self);
    }
}

/* What the period's begin sets off outside, once the pins carry this instant's values. */
void ftm_triggers(emu_t *emu)
{
    ftm_fault_input(emu);
    if (!emu->s.ftm[0].triggers_due) {
        return;
    }
    emu->s.ftm[0].triggers_due = false;
    emu->s.event = emu->s.ftm[0].start;
    if (sample_falls(emu)) {
        rdc_sample(emu);
    }
    if ((bus_get(emu, ftm0(), EXTTRIG) & 0x40U) != 0) {
        trgmux_event(emu, INIT_TRIGGER);
    }
    emu->s.event = NEVER;
    closed_update(emu);
}

/* ---- the bridge ---- */

/* The odd channel of a pair drives its pin only when it, too, has an edge (ELSB:ELSA). */
static bool both_drive(const emu_t *emu, int pair)
{
    const uint32_t upper = C0SC + 16U * (uint32_t)pair;
    return (bus_get(emu, ftm0(), upper) & 12U) == 8U && (bus_get(emu, ftm0(), upper + 8U) & 12U) == 8U;
}

static bool pair_follows(const emu_t *emu, int pair)
{
    const peripheral_t *self = ftm0();
    const ftm_t *f = &emu->s.ftm[0];
    const uint32_t both = 3U << (2 * pair);
    const uint32_t combine = bus_get(emu, self, COMBINE) >> (8 * pair);
    const uint32_t enabled = bus_get(emu, self, SC) >> 16, forced = bus_get(emu, self, SWOCTRL);
    const bool faulted = f->fault_latched && (combine & PAIR_FAULTEN) != 0;
    return f->running && (enabled & both) == both && (f->outmask & both) == 0 && (forced & both) == 0 && !faulted &&
           (combine & (PAIR_COMBINE | PAIR_COMP)) == (PAIR_COMBINE | PAIR_COMP) &&
           both_drive(emu, pair);
}

static double pair_duty(const ftm_t *f, int pair)
{
    const double from = f->cntin, to = (double)f->mod + 1.0;
    const double rise = f->cv[2 * pair], fall = f->cv[2 * pair + 1];
    const double high = (fall < to ? fall : to) - (rise > from ? rise : from);
    return high > 0.0 ? high / (to - from) : 0.0;
}

void emu_bridge(const emu_t *emu, emu_bridge_t *bridge)
{
    const peripheral_t *self = ftm0();
    const ftm_t *f = &emu->s.ftm[0];
    const uint32_t dead = bus_get(emu, self, DEADTIME);
    static const uint32_t prescaler[4] = {1, 1, 4, 16};
    const double clock_s = (double)clock_ticks(emu, self) / (double)EMU_TICKS_PER_S;
    bridge->gates = true;
    for (int pair = 0; pair < 3; pair++) {
        const bool dead_time = (bus_get(emu, self, COMBINE) >> (8 * pair) & PAIR_DTEN) != 0;
        bridge->duty[pair] = pair_duty(f, pair);
        bridge->gates = bridge->gates && pair_follows(emu, pair) && dead_time;
    }
    bridge->dead_time_s = ((dead & 63U) | (dead >> 16 & 15U) << 6) * prescaler[dead >> 6 & 3U] * clock_s;
    bridge->period_s = (double)(f->mod - f->cntin + 1U) * clock_s;
}
