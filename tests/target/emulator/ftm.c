/* SPDX-License-Identifier: Apache-2.0 */
/* FlexTimer: FTM0 as the bridge's modulator (up counting, combined complementary pairs with dead time, buffered and
 * synchronised compare values, output mask, software output control, fault input), FTM2 as quadrature decoder.
 *
 * documented behaviour                               | modelled | test
 * -------------------------------------------------- | -------- | --------------------------------------------
 * counter from CNTIN to MOD, prescaler               | yes      | test_the_counter_wraps_at_its_modulus
 * CnV buffered by SYNCEN, loaded by SWSYNC at CNTMAX | yes      | test_compare_values_wait_for_their_trigger
 * OUTMASK by hardware trigger with HWOM              | yes      | test_the_mask_waits_for_the_hardware_trigger
 * TRIGn cleared by the trigger (HWTRIGMODE 0)        | yes      | test_the_mask_waits_for_the_hardware_trigger
 * initialisation trigger by overflow                 | yes      | test_the_mask_waits_for_the_hardware_trigger
 * write protection                                   | refused  | test_the_fault_settings_are_write_protected
 * channel 6: the edge that samples a resolver        | yes      | test_a_resolver_image_computes_the_same_bits
 * FTM2: quadrature decoder                           | yes      | test_the_counter_follows_the_encoder
 * FTM2: counts from CNTIN, whatever the angle        | yes      | test_the_decoder_does_not_know_the_angle_at_its_start
 * FTM2: channel 2 captures the counter at its edge   | yes      | test_the_counter_is_captured_where_the_index_rises
 * BDMMODE: counter while the core is halted          | yes      | test_a_halted_core_leaves_outputs_as_bdmmode_says
 * up-down counting, interrupts, legacy sync, INVCTRL | refused  | test_other_timer_modes_are_refused
 * reload points, capture by other channels           | no       | -
 */
#include "ftm_private.h"

enum { INIT_TRIGGER = 22, C2SC = C0SC + 16, C2V = C0V + 16, CHF = 0x80 };

static const peripheral_t *of(int instance)
{
    return instance == 0 ? PERIPHERAL(FTM0) : PERIPHERAL(FTM2);
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

/* ---- index of the encoder: high for one count, at the shaft's zero ---- */

static uint32_t index_width(const emu_t *emu)
{
    return (uint32_t)((1ULL << 32) / (bus_get(emu, of(1), MOD) + 1ULL));
}

bool ftm_index(const emu_t *emu)
{
    return emu_angle(emu) < index_width(emu);
}

/* Whether the shaft has come to the index on its way. */
static bool index_rose(const emu_t *emu, uint32_t from, int32_t moved)
{
    const int64_t to = (int64_t)from + moved;
    const int64_t width = index_width(emu);
    return moved > 0 ? to >= 1LL << 32 : (int64_t)from >= width && to < width;
}

/* Channel 2 has the pin of the index and captures its rising edge (ELSA). */
static bool captures_index(const emu_t *emu, const peripheral_t *self)
{
    const uint32_t function = bus_get(emu, PERIPHERAL(PORTD), 4U * EMU_INDEX) >> 8 & 7U;
    return decoding(emu, self) && function == 2U && (bus_get(emu, self, C2SC) & 0x3CU) == 4U;
}

/* Called whenever the shaft's motion changes, and before the capture is read. */
void ftm_shaft(emu_t *emu)
{
    ftm_t *f = &emu->s.ftm[1];
    const peripheral_t *self = of(1);
    const uint32_t now = emu_angle(emu);
    const bool rose = index_rose(emu, f->shaft, (int32_t)(now - f->shaft));
    f->shaft = now;
    if (rose && captures_index(emu, self)) {
        bus_put(emu, self, C2V, f->quad_offset % (bus_get(emu, self, MOD) + 1U));
        bus_put(emu, self, C2SC, bus_get(emu, self, C2SC) | CHF);
    }
}

/* ---- registers ---- */

static uint32_t counter(const emu_t *emu, const peripheral_t *self, uint32_t stored)
{
    const ftm_t *f = &emu->s.ftm[self->instance];
    if (decoding(emu, self)) {
        return decoded(emu, self);
    }
    const uint64_t now = f->stopped_at != 0U ? f->stopped_at : emu->s.now;
    const uint32_t ticks = clock_ticks(emu, self);
    return f->running && ticks != 0U ? f->cntin + (uint32_t)((now - f->start) / ticks) : stored;
}

uint32_t ftm_read(emu_t *emu, const peripheral_t *self, uint32_t offset, uint32_t stored)
{
    ftm_t *f = &emu->s.ftm[self->instance];
    if (self->instance == 1 && (offset == C2SC || offset == C2V)) {
        ftm_shaft(emu);
        return bus_get(emu, self, offset);
    }
    switch (offset) {
    case CNT:
        f->read[1] = f->read[0];
        f->read[0] = counter(emu, self, stored);
        return f->read[0];
    case SC:
        return (stored & ~0x280U) | (f->tof ? 0x200U : 0U);
    case FMS:
        f->fault_seen = f->fault_latched;
        return self->instance == 0 ? ftm_fault_status(emu) : stored;
    default:
        return stored;
    }
}

/* The counter starts a period at CNTIN: emu_run() returns, so that its caller can set the pins for this instant. */
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
        pins_check(emu, self);
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

/* Writing WPEN = 1 clears WPDIS, which is its negation. */
static void protection_written(emu_t *emu, const peripheral_t *self, uint32_t value)
{
    if ((value & 0x40U) != 0) {
        bus_put(emu, self, MODE, bus_get(emu, self, MODE) & ~4U);
    }
}

/* Bits that the reference manual calls write protected. */
static uint32_t protected_bits(uint32_t offset)
{
    switch (offset) {
    case SC:
        return 0x3FU; /* CPWMS, CLKS, PS */
    case MODE:
        return 0x79U; /* FTMEN, PWMSYNC, CAPTEST, FAULTM */
    case COMBINE:
        return 0x57575757U; /* all but DECAP, SYNCEN, MCOMBINE */
    case FLTCTRL:
        return 0xFFU;
    case QDCTRL:
        return 1U;
    case DEADTIME:
    case POL:
    case FLTPOL:
        return 0xFFFFFFFFU;
    default:
        return offset >= C0SC && offset < C7V && (offset - C0SC) % 8U == 0 ? 0x3CU : 0U;
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

/* Channel 6 is SAMPLE of the resolver converter. True if it falls at the period's start: low up to C6V, then high. */
static bool sample_falls(const emu_t *emu)
{
    const peripheral_t *self = ftm0();
    const ftm_t *f = &emu->s.ftm[0];
    return (bus_get(emu, self, SC) >> 22 & 1U) != 0 && (bus_get(emu, self, SWOCTRL) >> 6 & 1U) == 0 &&
           (bus_get(emu, self, COMBINE) >> 24 & PAIR_COMBINE) != 0 && (bus_get(emu, self, C0SC + 48U) & 12U) == 8U &&
           f->cv[6] > f->cntin && f->cv[7] > f->mod;
}

/* Software sets the level of SAMPLE; a falling level samples the resolver. */
static void sample_held(emu_t *emu, uint32_t forced)
{
    const bool high = (forced >> 6 & 1U) != 0 && (forced >> 14 & 1U) != 0;
    if (emu->s.rdc.high && !high) {
        rdc_sample(emu);
    }
    emu->s.rdc.high = high;
}

/* The counter continues from its value: the encoder has edges, no absolute angle. */
static void decoder_starts(emu_t *emu, const peripheral_t *self)
{
    ftm_t *f = &emu->s.ftm[self->instance];
    f->quad_offset = 0;
    f->quad_offset = bus_get(emu, self, CNT) + bus_get(emu, self, MOD) + 1U - decoded(emu, self);
}

static void apply_write(emu_t *emu, const peripheral_t *self, uint32_t offset, uint32_t value)
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
        bus_put(emu, self, CNT, bus_get(emu, self, CNTIN));
        decoder_starts(emu, self);
    } else if (offset == OUTMASK && (bus_get(emu, self, SYNC) & 8U) == 0) {
        f->outmask = value;
    } else if (offset == SYNC) {
        sync_written(emu, self, value);
    } else if (offset == SWOCTRL && self->instance == 0) {
        sample_held(emu, value);
    } else if (offset == MODE) {
        mode_written(emu, self, value);
    } else if (offset == FMS) {
        protection_written(emu, self, value);
    } else if (offset == QDCTRL) {
        start_or_stop(emu, self);
    } else if (offset == C2SC && (value & CHF) == 0U) {
        bus_put(emu, self, C2SC, bus_get(emu, self, C2SC) & ~(uint32_t)CHF);
    }
    if (!f->running) {
        buffers_load(emu, self, true);
    }
}

static bool sets_outputs(uint32_t offset)
{
    return offset == SC || offset == OUTMASK || offset == SWOCTRL || offset == FMS || offset == POL;
}

static bool sets_fault_control(uint32_t offset)
{
    return offset == FLTCTRL || offset == FLTPOL || offset == FMS || offset == MODE || offset == SC;
}

void ftm_written(emu_t *emu, const peripheral_t *self, uint32_t offset, uint32_t old, uint32_t value)
{
    const bool ran = emu->s.ftm[self->instance].running;
    windings_follow(emu, emu->s.now);
    check_protection(emu, self, offset, old, value);
    apply_write(emu, self, offset, value);
    if (offset == QDCTRL && (value & ~old & 1U) != 0) {
        decoder_starts(emu, self);
    }
    if (self->instance == 0 && sets_fault_control(offset)) {
        ftm_fault_written(emu, offset, value);
    }
    if (self->instance == 0 && sets_outputs(offset)) {
        ftm_outputs_written(emu, offset, value);
        ftm_outputs_check(emu, emu->s.ftm[0].running && !ran);
    }
    windings_changed(emu);
}

/* ---- events ---- */

/* FTM0's hardware trigger is its own initialisation trigger, if TRGMUX connects it. With HWOM it loads the output
 * mask. */
static void hardware_trigger(emu_t *emu)
{
    const peripheral_t *self = ftm0();
    const uint32_t sync = bus_get(emu, self, SYNC), conf = bus_get(emu, self, SYNCONF);
    const bool connected = (bus_get(emu, PERIPHERAL(TRGMUX), 0x28) & 0x3FU) == INIT_TRIGGER;
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

/* The counter goes from MOD to CNTIN: the loading point (SYNC.CNTMAX) and the start of the period. */
void ftm_fire(emu_t *emu, int instance)
{
    const peripheral_t *self = of(instance);
    ftm_t *f = &emu->s.ftm[instance];
    const uint32_t sync = bus_get(emu, self, SYNC);
    windings_follow(emu, emu_instant(emu));
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
        ftm_fault_period(emu);
        ftm_outputs_check(emu, true);
        period_begins(emu, self);
    }
}

/* The effects of the period's start on other modules, after the pins have been set for this instant. */
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
}

/* A debugger has halted the core, or lets it continue. With BDMMODE 3 the counter runs on meanwhile. */
void ftm_debug(emu_t *emu, bool halted)
{
    ftm_t *f = &emu->s.ftm[0];
    if (!f->running || (bus_get(emu, ftm0(), CONF) >> 6 & 3U) == 3U || halted == (f->stopped_at != 0U)) {
        return;
    }
    if (halted) {
        f->stopped_at = emu->s.now;
        emu_timer(emu, TIMER_FTM0, NEVER);
    } else {
        f->start += emu->s.now - f->stopped_at;
        f->stopped_at = 0;
        emu_timer(emu, TIMER_FTM0, f->start + period_ticks(emu, ftm0()));
    }
}
