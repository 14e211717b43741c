/* SPDX-License-Identifier: Apache-2.0 */
/* FTM0's outputs: which of them may switch on, and the state of the bridge for the plant.
 *
 * documented behaviour                              | modelled | test
 * ------------------------------------------------- | -------- | --------------------------------------------
 * PWMEN and ELSB:ELSA let a channel drive its pin   | yes      | test_an_output_requires_its_enable_and_its_edge
 * OUTMASK: inactive; SWOCTRL: forced low            | yes      | test_mask_and_software_control_switch_off
 * a fault overrides all of these                    | yes      | test_the_fault_mode_chooses_the_channels
 * COMBINE, COMP, DTEN: complementary with dead time | yes      | test_the_timer_is_set_up_as_the_motor_file_says
 * BDMMODE: outputs while the core is halted         | yes      | test_a_halted_core_leaves_outputs_as_bdmmode_says
 * SWOCTRL forcing the lower outputs high            | yes      | test_the_lower_outputs_are_forced_high_together
 * SWOCTRL forcing others high; POL: active low      | refused  | test_other_output_settings_are_refused
 * level of each output, with dead time              | yes      | test_a_pin_reads_what_the_timer_drives
 * only some outputs may switch on                   | refused  | test_a_bridge_with_only_some_outputs_on_is_refused
 * a pair without COMBINE, COMP, DTEN                | refused  | test_a_pair_without_dead_time_is_refused
 */
#include "ftm_private.h"

enum { BDM_SAFE = 1, EDGE_HIGH_TRUE = 8, EDGE_BITS = 12, LOWER_OUTPUTS = 0x2A };

static bool drives_pin(const emu_t *emu, uint32_t channel)
{
    const uint32_t control = bus_get(emu, ftm0(), C0SC + 8U * channel);
    return (bus_get(emu, ftm0(), SC) >> (16U + channel) & 1U) != 0 && (control & EDGE_BITS) == EDGE_HIGH_TRUE;
}

uint32_t ftm_driven(const emu_t *emu)
{
    const ftm_t *f = &emu->s.ftm[0];
    const uint32_t forced = bus_get(emu, ftm0(), SWOCTRL);
    const bool safe_in_debug = emu->s.halted && (bus_get(emu, ftm0(), CONF) >> 6 & 3U) == BDM_SAFE;
    uint32_t driven = 0;
    for (uint32_t channel = 0; channel < EMU_PWM_CHANNELS; channel++) {
        driven |= drives_pin(emu, channel) ? 1U << channel : 0U;
    }
    const uint32_t possible = safe_in_debug ? 0U : driven & ~(f->outmask | ftm_fault_channels(emu));
    return possible & ((f->running ? ~forced : 0U) | (forced & forced >> 8));
}

static bool forced_short_circuit(const emu_t *emu)
{
    const uint32_t forced = bus_get(emu, ftm0(), SWOCTRL);
    return (forced & SIX_OUTPUTS) == SIX_OUTPUTS && (forced >> 8 & SIX_OUTPUTS) == LOWER_OUTPUTS;
}

static bool pair_complementary(const emu_t *emu, int pair)
{
    const uint32_t wanted = PAIR_COMBINE | PAIR_COMP | PAIR_DTEN;
    return (bus_get(emu, ftm0(), COMBINE) >> (8 * pair) & wanted) == wanted;
}

static double pair_duty(const ftm_t *f, int pair)
{
    const double from = f->cntin, to = (double)f->mod + 1.0;
    const double rise = f->cv[(ptrdiff_t)2 * pair], fall = f->cv[(ptrdiff_t)2 * pair + 1];
    const double high = (fall < to ? fall : to) - (rise > from ? rise : from);
    return high > 0.0 ? high / (to - from) : 0.0;
}

static double clock_s(const emu_t *emu)
{
    const uint32_t sc = bus_get(emu, ftm0(), SC);
    const uint64_t ticks = (sc >> 3 & 3U) == 1U ? (uint64_t)emu->s.core_ticks << (sc & 7U) : 0U;
    return (double)ticks / (double)EMU_TICKS_PER_S;
}

static double dead_time_s(const emu_t *emu)
{
    static const uint32_t prescaler[4] = {1, 1, 4, 16};
    const uint32_t dead = bus_get(emu, ftm0(), DEADTIME);
    return ((dead & 63U) | (dead >> 16 & 15U) << 6) * prescaler[dead >> 6 & 3U] * clock_s(emu);
}

void emu_bridge(const emu_t *emu, emu_bridge_t *bridge)
{
    const ftm_t *f = &emu->s.ftm[0];
    bridge->driven = (uint8_t)ftm_driven(emu);
    const bool forced = forced_short_circuit(emu) && bridge->driven == LOWER_OUTPUTS;
    bridge->gates = bridge->driven == SIX_OUTPUTS || forced;
    for (int pair = 0; pair < 3; pair++) {
        bridge->duty[pair] = forced ? 0.0 : pair_duty(f, pair);
        bridge->gates = bridge->gates && pair_complementary(emu, pair);
    }
    bridge->dead_time_s = dead_time_s(emu);
    bridge->period_s = (double)(f->mod - f->cntin + 1U) * clock_s(emu);
}

/* Ticks since the last edge at `from`, in a period of the counter. */
static uint32_t since(const ftm_t *f, uint32_t tick, uint32_t from)
{
    const uint32_t period = f->mod - f->cntin + 1U;
    return tick >= from ? tick - from : tick + period - from;
}

/* Bit 0: the upper output of the pair, bit 1: the lower one. Both are low for the dead time after each edge. */
static uint32_t pair_levels(const emu_t *emu, uint32_t pair, uint32_t tick)
{
    const ftm_t *f = &emu->s.ftm[0];
    const size_t first = (size_t)2U * pair;
    const uint32_t rise = f->cv[first], fall = f->cv[first + 1U];
    const uint32_t dead = (uint32_t)(dead_time_s(emu) / clock_s(emu) + 0.5);
    const bool pulse = tick >= rise && tick < fall;
    const bool has_edges = rise <= f->mod && fall <= f->mod && rise != f->cntin;
    const bool dead_now = has_edges && since(f, tick, pulse ? rise : fall) < dead;
    return dead_now ? 0U : pulse ? 1U : 2U;
}

uint32_t ftm_levels(const emu_t *emu)
{
    const ftm_t *f = &emu->s.ftm[0];
    const uint32_t forced = bus_get(emu, ftm0(), SWOCTRL);
    uint32_t by_counter = 0;
    if (f->running) {
        const uint64_t now = f->stopped_at != 0U ? f->stopped_at : emu->s.now;
        const uint32_t tick = f->cntin + (uint32_t)((double)(now - f->start) / (clock_s(emu) * EMU_TICKS_PER_S));
        for (uint32_t pair = 0; pair < 3U; pair++) {
            by_counter |= pair_levels(emu, pair, tick) << (2U * pair);
        }
    }
    return ftm_driven(emu) & ((by_counter & ~forced) | (forced & forced >> 8));
}

/* The plant takes one state of the bridge per period: within a period switching may be disabled, but not enabled. */
void ftm_outputs_check(emu_t *emu, bool period_begins)
{
    emu_bridge_t now;
    emu_bridge(emu, &now);
    if (now.driven != 0U && !now.gates && period_begins) {
        emu_fail(emu, "FTM0 drives the outputs 0x%02x of 0x3f, or a pair without COMBINE, COMP and DTEN",
                 (unsigned)now.driven);
    }
    const bool by_timer = now.gates && now.driven == SIX_OUTPUTS;
    if (by_timer && !emu->s.ftm[0].switching && !period_begins) {
        emu_fail(emu, "FTM0: switching is enabled in the middle of a period");
    }
    emu->s.ftm[0].switching = now.gates;
}

void ftm_outputs_written(emu_t *emu, uint32_t offset, uint32_t value)
{
    if (offset == POL && value != 0U) {
        emu_fail(emu, "write of FTM0.POL: outputs that are active low are not modelled");
    } else if (offset == SWOCTRL && (value >> 8 & SIX_OUTPUTS) != 0U && !forced_short_circuit(emu)) {
        emu_fail(emu, "write of FTM0.SWOCTRL: other outputs forced high than all lower ones are not modelled");
    }
}
