/* SPDX-License-Identifier: Apache-2.0 */
/* Analogue-to-digital converters. A result is the value at the pin when the conversion ends; the values at the pins
 * change once per PWM period, at its start, but for those of an analogue angle sensor (analogue.c). A conversion takes
 * SMPLTS + 1 + 30 converter clocks, about as long as in the data sheet.
 *
 * How long a calibration takes is not known. The manuals of the sister family Kinetis say, from memory, as many as
 * 14,000 converter clocks (and 100 of the bus, which are left out). Seven values with an average of 32 conversions
 * each would be 9,632. The longer one is used, and emu_adc_calibration() sets another.
 *
 * documented behaviour                               | modelled | test
 * -------------------------------------------------- | -------- | --------------------------------------------
 * a trigger converts the input of SC1n into Rn       | yes      | test_back_to_back_conversions_follow_at_once
 * software trigger by SC1A while ADTRG is 0          | yes      | test_a_written_sc1a_converts_at_once
 * conversion takes SMPLTS + 31 clocks, averages more | yes      | test_averaging_takes_as_many_conversions
 * COCO set at the end, cleared by Rn or SC1n         | yes      | test_complete_is_cleared_by_result_or_control
 * AIEN: interrupt while COCO is set                  | yes      | test_a_complete_conversion_interrupts_if_enabled
 * ADCH 31: no conversion                             | yes      | test_the_disabled_input_is_not_converted
 * a trigger during a conversion is ignored           | yes      | test_a_trigger_during_a_conversion_is_ignored
 * calibration before use, and its conditions         | refused  | test_what_is_not_modelled_is_an_error
 * CAL is set for as long as a calibration takes      | yes      | test_a_calibration_takes_its_time
 * each converter calibrates by itself               | yes      | test_both_converters_calibrate_at_the_same_time
 * a register written during a calibration            | refused  | test_a_write_during_a_calibration_is_refused
 * shortest sample time, fastest clock                | refused  | test_what_is_not_modelled_is_an_error
 * 8 and 10 bits                                      | refused  | test_other_resolutions_are_refused
 * comparison, DMA                                    | refused  | test_other_converter_modes_are_refused
 * noise, offset, gain and their calibration          | no       | -
 */
#include "emu_private.h"

enum {
    SC1 = 0x00,
    SC1_LAST = 0x3C,
    CFG1 = 0x40,
    CFG2 = 0x44,
    R = 0x48,
    R_LAST = 0x84,
    SC2 = 0x90,
    SC3 = 0x94,
    TRIM = 0x98,
    CLPS = 0xB4,
    CLP9 = 0xCC,
    SAMPLE_MIN = 924, /* 275 ns */
    COCO = 0x80,
    AIEN = 0x40,
    OFF = 31,
    CONVERSION = 30,
    CALIBRATING = 100, /* in place of a conversion's number */
    CAL = 0x80,
    ADC0_IRQ = 39,
    ADC1_IRQ = 40,
};

static const peripheral_t *of(int instance)
{
    return instance == 0 ? PERIPHERAL(ADC0) : PERIPHERAL(ADC1);
}

bool adc_models(uint32_t offset)
{
    return offset <= R_LAST || (offset >= SC2 && offset <= 0xE8U);
}

static void line_update(emu_t *emu, const peripheral_t *self)
{
    bool level = false;
    for (uint32_t at = SC1; at <= SC1_LAST; at += 4U) {
        level = level || (bus_get(emu, self, at) & (COCO | AIEN)) == (COCO | AIEN);
    }
    nvic_line(emu, self->instance == 0 ? ADC0_IRQ : ADC1_IRQ, level);
}

uint32_t adc_read(emu_t *emu, const peripheral_t *self, uint32_t offset, uint32_t stored)
{
    if (offset >= R && offset <= R_LAST) {
        const uint32_t control = offset - R;
        bus_put(emu, self, control, bus_get(emu, self, control) & ~(uint32_t)COCO);
        line_update(emu, self);
    }
    return stored;
}

static uint32_t conversion_clock(const emu_t *emu, const peripheral_t *self)
{
    return clocks_peripheral_ticks(emu, self->gate) << (bus_get(emu, self, CFG1) >> 5 & 3U);
}

static uint64_t conversion_ticks(emu_t *emu, const peripheral_t *self)
{
    const uint32_t cfg1 = bus_get(emu, self, CFG1), sc3 = bus_get(emu, self, SC3);
    const uint32_t clock = conversion_clock(emu, self);
    if (clock == 0 || (cfg1 & 3U) != 0) {
        emu_fail(emu, "%s converts without a clock (PCC, SCG divider 2, CFG1.ADICLK)", self->name);
        return 1;
    }
    if (clock < 67U) { /* 50 MHz */
        emu_fail(emu, "%s: the converter's clock is above 50 MHz", self->name);
    }
    if ((cfg1 >> 2 & 3U) != 1U) {
        emu_fail(emu, "%s: only 12-bit conversions are modelled (CFG1.MODE = 1)", self->name);
    }
    if (((bus_get(emu, self, CFG2) & 0xFFU) + 1U) * clock < SAMPLE_MIN) {
        emu_fail(emu, "%s: a sample takes less than 275 ns (CFG2.SMPLTS)", self->name);
    }
    const uint32_t each = (bus_get(emu, self, CFG2) & 0xFFU) + 1U + CONVERSION;
    return (uint64_t)clock * each * ((sc3 & 4U) != 0 ? 4U << (sc3 & 3U) : 1U);
}

static bool start(emu_t *emu, const peripheral_t *self, int channel)
{
    adc_t *a = &emu->s.adc[self->instance];
    if ((bus_get(emu, self, 4U * (uint32_t)channel) & 31U) == OFF) {
        return false;
    }
    if (!a->calibrated) {
        emu_fail(emu, "%s converts without having been calibrated", self->name);
    }
    a->current = channel + 1;
    a->done = emu_instant(emu) + conversion_ticks(emu, self);
    emu_timer(emu, self->instance == 0 ? TIMER_ADC0 : TIMER_ADC1, a->done);
    return true;
}

/* The reference manual's conditions: software trigger, average of 32, at most half the fastest clock, and the results
 * of earlier calibrations cleared. */
static void calibrate(emu_t *emu, const peripheral_t *self)
{
    (void)conversion_ticks(emu, self); /* calibration needs a clock, too */
    bool clear = true;
    for (uint32_t at = CLPS; at <= CLP9; at += 4U) {
        clear = clear && bus_get(emu, self, at) == 0U;
    }
    const uint32_t clock = conversion_clock(emu, self);
    if ((bus_get(emu, self, SC2) & 0x40U) != 0 || (bus_get(emu, self, SC3) & 7U) != 7U || clock < 2U * 67U) {
        emu_fail(emu, "write of %s.SC3: calibration requires ADTRG = 0, average 32, at most 25 MHz", self->name);
    } else if (!clear) {
        emu_fail(emu, "write of %s.SC3: calibration requires CLPS ... CLP9 to be 0", self->name);
    }
    adc_t *a = &emu->s.adc[self->instance];
    a->current = CALIBRATING;
    a->done = emu_instant(emu) + (uint64_t)emu->calibration * clock;
    emu_timer(emu, self->instance == 0 ? TIMER_ADC0 : TIMER_ADC1, a->done);
}

void emu_adc_calibration(emu_t *emu, uint32_t clocks)
{
    emu->calibration = clocks;
}

static void calibration_end(emu_t *emu, const peripheral_t *self)
{
    emu->s.adc[self->instance].current = 0;
    emu->s.adc[self->instance].calibrated = true;
    bus_put(emu, self, SC3, bus_get(emu, self, SC3) & ~(uint32_t)CAL);
    bus_put(emu, self, SC1, bus_get(emu, self, SC1) | COCO);
}

void adc_written(emu_t *emu, const peripheral_t *self, uint32_t offset, uint32_t old, uint32_t value)
{
    (void)old;
    if (emu->s.adc[self->instance].current == CALIBRATING) {
        emu_fail(emu, "write of %s offset 0x%x while it calibrates", self->name, offset);
    } else if (offset == SC2 && (value & 0x3CU) != 0) {
        emu_fail(emu, "write of %s.SC2: comparison and DMA are not modelled", self->name);
    } else if (offset == SC3 && (value & CAL) != 0) {
        calibrate(emu, self);
    } else if (offset <= SC1_LAST) {
        bus_put(emu, self, offset, value & (AIEN | 31U)); /* clears COCO */
        line_update(emu, self);
        if (offset == SC1 && (bus_get(emu, self, SC2) & 0x40U) == 0) {
            (void)start(emu, self, 0);
        }
    }
}

/* A trigger that comes during a conversion is ignored. */
bool adc_pretrigger(emu_t *emu, int instance, int channel)
{
    const peripheral_t *self = of(instance);
    const bool listens = (bus_get(emu, PERIPHERAL(PCC), self->gate) & 1U << 30) != 0 &&
                         (bus_get(emu, self, SC2) & 0x40U) != 0;
    return listens && emu->s.adc[instance].current == 0 && start(emu, self, channel);
}

void adc_fire(emu_t *emu, int instance)
{
    const peripheral_t *self = of(instance);
    adc_t *a = &emu->s.adc[instance];
    if (a->current == CALIBRATING) {
        calibration_end(emu, self);
        return;
    }
    const int channel = a->current - 1;
    const uint32_t control = 4U * (uint32_t)channel;
    const uint32_t input = bus_get(emu, self, control) & 31U;
    const bool read_before = (bus_get(emu, self, control) & COCO) == 0;
    a->current = 0;
    const uint64_t sampled = a->done - (uint64_t)CONVERSION * conversion_clock(emu, self);
    bus_put(emu, self, R + control,
            analogue_is_at(emu, instance, input) ? analogue_count(emu, instance, sampled)
                                                 : emu->s.pins.adc[instance][input] & 0xFFFU);
    bus_put(emu, self, control, bus_get(emu, self, control) | COCO);
    line_update(emu, self);
    if ((bus_get(emu, self, SC2) & 0x40U) != 0 && read_before) { /* COCO has risen: the last result was read */
        pdb_acknowledge(emu, instance, channel);
    }
}
