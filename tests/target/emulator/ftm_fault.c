/* SPDX-License-Identifier: Apache-2.0 */
/* FTM0's fault control: from the pin to the outputs without the core.
 *
 * A fault of the gate driver pulls the pin low. The delay of the input is 3 cycles of the timer's clock without the
 * filter and 4 + FFVAL (FLTPS + 1) with it; a shorter pulse is ignored. The edge after the filter sets FAULTF.
 *
 * documented behaviour                                 | modelled | test
 * ---------------------------------------------------- | -------- | --------------------------------------------
 * FLTPOL: which level of the pin is a fault            | yes      | test_the_level_of_fltpol_is_the_fault
 * FAULT0EN: the input is evaluated                     | yes      | test_an_input_that_is_not_enabled_does_nothing
 * FFLTR0EN, FFVAL, FLTPS: delay, pulses ignored        | yes      | test_the_filter_delays_and_ignores_pulses
 * FAULTM 0, 1, 2: no channels, even channels, all      | yes      | test_the_fault_mode_chooses_the_channels
 * FAULTEN of each pair                                 | yes      | test_only_pairs_with_faulten_are_switched_off
 * FAULTF set by an edge while fault control is on      | yes      | test_a_fault_before_fault_control_sets_no_flag
 * FAULTF cleared by reading 1, then writing 0, if over | yes      | test_the_flag_is_cleared_by_read_then_write
 * outputs return at the next period's start            | yes      | test_outputs_return_with_the_next_period
 * FAULTIN follows the filtered input                   | yes      | test_the_filter_delays_and_ignores_pulses
 * FAULTIE: interrupt while FAULTF is set               | yes      | test_the_fault_interrupts_while_its_flag_is_set
 * write protection                                     | yes      | test_the_fault_settings_are_write_protected
 * FAULTM 3, FAULT1EN ... FAULT3EN, FSTATE              | refused  | test_other_fault_settings_are_refused
 */
#include "ftm_private.h"

enum {
    FAULT_IRQ = 103,
    FAULT0EN = 1 << 0,
    FFLTR0EN = 1 << 4,
    OTHER_INPUTS = 0xE | 0xE0,
    FSTATE = 1 << 15,
    FAULTIE = 1 << 7,
    FAULTIN = 1 << 5,
    WPEN = 1 << 6,
    FAULTF = 1 << 7,
    FAULTF0 = 1 << 0,
    NO_FILTER_CYCLES = 3,
    FILTER_CYCLES = 4,
    FAULTM_EVEN = 1,
    FAULTM_AUTOMATIC = 3,
    EVEN_CHANNELS = 0x55,
};

static uint32_t mode_of(const emu_t *emu)
{
    return bus_get(emu, ftm0(), MODE) >> 5 & 3U;
}

static void line_update(emu_t *emu)
{
    const bool enabled = (bus_get(emu, ftm0(), MODE) & FAULTIE) != 0;
    nvic_line(emu, FAULT_IRQ, enabled && emu->s.ftm[0].fault_latched);
}

uint32_t ftm_fault_status(const emu_t *emu)
{
    const ftm_t *f = &emu->s.ftm[0];
    const uint32_t kept = bus_get(emu, ftm0(), FMS) & WPEN;
    return kept | (f->fault_input ? FAULTIN : 0U) | (f->fault_latched ? (uint32_t)(FAULTF | FAULTF0) : 0U);
}

static bool input_active(const emu_t *emu)
{
    const bool high = !emu->s.pins.gate_fault;
    const bool active_low = (bus_get(emu, ftm0(), FLTPOL) & 1U) != 0;
    return (bus_get(emu, ftm0(), FLTCTRL) & FAULT0EN) != 0 && high != active_low;
}

static uint64_t filter_ticks(const emu_t *emu)
{
    const uint32_t control = bus_get(emu, ftm0(), FLTCTRL), value = control >> 8 & 15U;
    const uint32_t prescaler = (bus_get(emu, ftm0(), SC) >> 24 & 15U) + 1U;
    const bool filtered = (control & FFLTR0EN) != 0 && value != 0U;
    return (uint64_t)(filtered ? FILTER_CYCLES + value * prescaler : NO_FILTER_CYCLES) * emu->s.core_ticks;
}

/* The pin or its settings have changed: a level that differs from the filter's output reaches it after the delay,
 * unless the level changes back before. */
void ftm_fault_input(emu_t *emu)
{
    ftm_t *f = &emu->s.ftm[0];
    const bool on_its_way = emu->s.due[TIMER_FAULT] != NEVER;
    if (input_active(emu) == f->fault_input) {
        emu_timer(emu, TIMER_FAULT, NEVER);
    } else if (!on_its_way) {
        emu_timer(emu, TIMER_FAULT, emu_instant(emu) + filter_ticks(emu));
    }
}

void ftm_fault_fire(emu_t *emu)
{
    ftm_t *f = &emu->s.ftm[0];
    f->fault_input = input_active(emu);
    if (f->fault_input && mode_of(emu) != 0U) {
        f->fault_latched = true;
        f->fault_holds = true;
        f->fault_seen = false;
        line_update(emu);
        ftm_outputs_check(emu, false);
    }
}

static void settings_check(emu_t *emu, uint32_t offset, uint32_t value)
{
    if (offset == FLTCTRL && (value & (OTHER_INPUTS | FSTATE)) != 0) {
        emu_fail(emu, "write of FTM0.FLTCTRL: fault inputs 1 ... 3 and FSTATE are not modelled");
    } else if (offset == FLTPOL && (value & ~1U) != 0) {
        emu_fail(emu, "write of FTM0.FLTPOL: fault inputs 1 ... 3 are not modelled");
    } else if (offset == MODE && (value >> 5 & 3U) == FAULTM_AUTOMATIC) {
        emu_fail(emu, "write of FTM0.MODE: automatic fault clearing (FAULTM = 3) is not modelled");
    }
}

/* FAULTF is cleared if it has been read as 1 and is then written 0 while the input is inactive. */
static void status_written(emu_t *emu, uint32_t value)
{
    ftm_t *f = &emu->s.ftm[0];
    if ((value & FAULTF) == 0 && !f->fault_input && f->fault_seen) {
        f->fault_seen = false;
        f->fault_latched = false;
    }
}

void ftm_fault_written(emu_t *emu, uint32_t offset, uint32_t value)
{
    settings_check(emu, offset, value);
    if (offset == FMS) {
        status_written(emu, value);
    }
    line_update(emu);
    ftm_fault_input(emu);
}

/* Outputs that a fault has switched off return only at the start of a period. */
void ftm_fault_period(emu_t *emu)
{
    ftm_t *f = &emu->s.ftm[0];
    f->fault_holds = f->fault_latched;
}

uint32_t ftm_fault_channels(const emu_t *emu)
{
    if (!emu->s.ftm[0].fault_holds) {
        return 0;
    }
    const uint32_t combine = bus_get(emu, ftm0(), COMBINE);
    uint32_t channels = 0;
    for (uint32_t pair = 0; pair < 4U; pair++) {
        channels |= (combine >> (8U * pair) & PAIR_FAULTEN) != 0 ? 3U << (2U * pair) : 0U;
    }
    return mode_of(emu) == FAULTM_EVEN ? channels & EVEN_CHANNELS : channels;
}
