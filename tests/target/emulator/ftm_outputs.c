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
 * SWOCTRL forcing high; POL: active low             | refused  | test_other_output_settings_are_refused
 * only some outputs may switch on                   | refused  | test_a_bridge_with_only_some_outputs_on_is_refused
 * a pair without COMBINE, COMP, DTEN                | refused  | test_a_pair_without_dead_time_is_refused
 */
#include "ftm_private.h"

enum { BDM_SAFE = 1, EDGE_HIGH_TRUE = 8, EDGE_BITS = 12 };

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
    return f->running && !safe_in_debug ? driven & ~(f->outmask | forced | ftm_fault_channels(emu)) : 0U;
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

void emu_bridge(const emu_t *emu, emu_bridge_t *bridge)
{
    const ftm_t *f = &emu->s.ftm[0];
    const uint32_t dead = bus_get(emu, ftm0(), DEADTIME);
    static const uint32_t prescaler[4] = {1, 1, 4, 16};
    bridge->driven = (uint8_t)ftm_driven(emu);
    bridge->gates = bridge->driven == SIX_OUTPUTS;
    for (int pair = 0; pair < 3; pair++) {
        bridge->duty[pair] = pair_duty(f, pair);
        bridge->gates = bridge->gates && pair_complementary(emu, pair);
    }
    bridge->dead_time_s = ((dead & 63U) | (dead >> 16 & 15U) << 6) * prescaler[dead >> 6 & 3U] * clock_s(emu);
    bridge->period_s = (double)(f->mod - f->cntin + 1U) * clock_s(emu);
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
    if (now.gates && !emu->s.ftm[0].switching && !period_begins) {
        emu_fail(emu, "FTM0: switching is enabled in the middle of a period");
    }
    emu->s.ftm[0].switching = now.gates;
}

void ftm_outputs_written(emu_t *emu, uint32_t offset, uint32_t value)
{
    if (offset == POL && value != 0U) {
        emu_fail(emu, "write of FTM0.POL: outputs that are active low are not modelled");
    } else if (offset == SWOCTRL && (value >> 8 & SIX_OUTPUTS) != 0U) {
        emu_fail(emu, "write of FTM0.SWOCTRL: outputs 0 ... 5 forced high are not modelled");
    }
}
