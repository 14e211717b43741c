/* SPDX-License-Identifier: Apache-2.0 */
/* PORT, GPIO and the trigger multiplexer.
 *
 * documented behaviour                       | modelled | test
 * ------------------------------------------ | -------- | --------------------------------------------
 * PORT: pin functions that peripherals need  | refused  | test_what_is_not_modelled_is_an_error
 * PORT: lock                                 | refused  | test_writing_a_locked_pin_is_refused
 * PORT: interrupts of pins                   | refused  | test_pin_interrupts_are_refused
 * PORT: GPCLR, GPCHR                         | yes      | test_many_pins_are_set_at_once
 * GPIO: set, clear, toggle                   | yes      | test_lines_are_set_cleared_and_toggled
 * GPIO: a line that is no output             | refused  | test_what_is_not_modelled_is_an_error
 * TRGMUX: source of PDB0, PDB1, FTM0; lock   | refused  | test_a_locked_trigger_keeps_its_source
 * TRGMUX: pulse of PDB0 to LPSPI0 and LPSPI1 | yes      | test_a_request_starts_one_frame_per_pulse
 * TRGMUX: every other target                 | refused  | test_other_trigger_targets_are_refused
 * GPIO: PDIR is the level of a digital pin   | yes      | test_a_pin_reads_what_the_timer_drives
 * GPIO: levels from outside                  | no       | -
 */
#include "emu_private.h"

enum {
    PCR_LAST = 0x7C,
    GPCLR = 0x80,
    GPCHR = 0x84,
    ISFR = 0xA0,
    PDOR = 0x00,
    PSOR = 0x04,
    PCOR = 0x08,
    PTOR = 0x0C,
    PDIR = 0x10,
    PDDR = 0x14,
    TO_PDB0 = 0x38,
    TO_PDB1 = 0x3C,
    TO_LPSPI0 = 0x5C,
    TO_LPSPI1 = 0x60,
    FLAG = 1 << 24,
};
#define LOCK (1U << 31)

/* The pins and pin functions that a peripheral needs, from the manufacturer's table of signal multiplexing. */
static const struct {
    uint8_t peripheral, port, pin, function;
} wiring[] = {
#define PIN(peripheral, port, pin, function) {PERIPHERAL_##peripheral, PERIPHERAL_##port, pin, function}
    PIN(FTM0, PORTD, 15, 2),  PIN(FTM0, PORTD, 16, 2),  PIN(FTM0, PORTD, 0, 2),   PIN(FTM0, PORTD, 1, 2),
    PIN(FTM0, PORTB, 4, 2),   PIN(FTM0, PORTB, 5, 2),   PIN(FTM0, PORTE, 8, 2),   PIN(FTM0, PORTA, 14, 2),
    PIN(FTM2, PORTD, 10, 3),  PIN(FTM2, PORTD, 11, 3),  PIN(CAN0, PORTE, 4, 5),   PIN(CAN0, PORTE, 5, 5),
    PIN(LPSPI0, PORTB, 0, 3), PIN(LPSPI0, PORTB, 1, 3), PIN(LPSPI0, PORTB, 2, 3), PIN(LPSPI0, PORTB, 3, 3),
};

static void check_pin(emu_t *emu, const peripheral_t *user, const peripheral_t *port, uint32_t pin, uint32_t function)
{
    if ((bus_get(emu, port, 4U * pin) >> 8 & 7U) != function) {
        emu_fail(emu, "%s is used, but %s.PCR%u does not give it the pin (MUX %u)", user->name, port->name, pin,
                 function);
    }
}

void pins_check(emu_t *emu, const peripheral_t *peripheral)
{
    for (size_t k = 0; k < sizeof wiring / sizeof wiring[0]; k++) {
        if (&peripherals[wiring[k].peripheral] == peripheral) {
            check_pin(emu, peripheral, &peripherals[wiring[k].port], wiring[k].pin, wiring[k].function);
        }
    }
}

/* The port that gives the pins of this GPIO their functions. */
static const peripheral_t *port_of(const peripheral_t *gpio)
{
    return PERIPHERAL(PORTA) + (gpio - PERIPHERAL(PTA));
}

/* A line that is switched on must be an output, and its pin must be connected to the GPIO. */
static void check_lines(emu_t *emu, const peripheral_t *self, uint32_t lines)
{
    for (uint32_t pin = 0; pin < 32U; pin++) {
        if ((lines >> pin & 1U) == 0) {
            continue;
        }
        check_pin(emu, self, port_of(self), pin, 1);
        if ((bus_get(emu, self, PDDR) >> pin & 1U) == 0) {
            emu_fail(emu, "%s: line %u is switched on, but it is an input (PDDR)", self->name, pin);
        }
    }
}

bool port_models(uint32_t offset)
{
    return offset <= GPCHR || offset == ISFR;
}

uint32_t port_read(emu_t *emu, const peripheral_t *self, uint32_t offset, uint32_t stored)
{
    (void)emu, (void)self, (void)offset;
    return stored;
}

static void write_many_pins(emu_t *emu, const peripheral_t *self, uint32_t first, uint32_t value)
{
    for (uint32_t i = 0; i < 16U; i++) {
        const uint32_t at = 4U * (first + i);
        if ((value >> (16U + i) & 1U) != 0) {
            bus_put(emu, self, at, (bus_get(emu, self, at) & ~0xFFFFU) | (value & 0xFFFFU));
        }
    }
}

void port_written(emu_t *emu, const peripheral_t *self, uint32_t offset, uint32_t old, uint32_t value)
{
    if (offset <= PCR_LAST) {
        if ((old & 1U << 15) != 0) {
            emu_fail(emu, "write of %s.PCR%u: the pin is locked", self->name, offset / 4U);
        }
        if ((value >> 16 & 15U) != 0) {
            emu_fail(emu, "write of %s.PCR%u: interrupts of pins are not modelled", self->name, offset / 4U);
        }
        bus_put(emu, self, offset, value & ~(uint32_t)FLAG);
    } else if (offset == GPCLR || offset == GPCHR) {
        write_many_pins(emu, self, offset == GPCLR ? 0U : 16U, value);
    }
}

/* The level of FTM0's outputs 0 ... 5 at the pins of a port that they are given to. */
static uint32_t timer_levels(const emu_t *emu, const peripheral_t *port, uint32_t of_gpio)
{
    const uint32_t outputs = ftm_levels(emu);
    for (uint32_t k = 0; k < EMU_PWM_CHANNELS; k++) {
        const uint32_t pin = wiring[k].pin;
        if (&peripherals[wiring[k].port] == port && (bus_get(emu, port, 4U * pin) >> 8 & 7U) == wiring[k].function) {
            of_gpio = (of_gpio & ~(1U << pin)) | (outputs >> k & 1U) << pin;
        }
    }
    return of_gpio;
}

static uint32_t levels(const emu_t *emu, const peripheral_t *self)
{
    const uint32_t index = self->name[2] == 'D' && ftm_index(emu) ? 1U << EMU_INDEX : 0U;
    return index | timer_levels(emu, port_of(self), bus_get(emu, self, PDOR) & bus_get(emu, self, PDDR));
}

bool gpio_models(uint32_t offset)
{
    return offset <= PDDR;
}

uint32_t gpio_read(emu_t *emu, const peripheral_t *self, uint32_t offset, uint32_t stored)
{
    if (offset == PDIR) {
        return levels(emu, self);
    }
    return offset == PSOR || offset == PCOR || offset == PTOR ? 0U : stored;
}

void gpio_written(emu_t *emu, const peripheral_t *self, uint32_t offset, uint32_t old, uint32_t value)
{
    (void)old;
    const uint32_t out = bus_get(emu, self, PDOR);
    if (offset == PSOR) {
        check_lines(emu, self, value);
        bus_put(emu, self, PDOR, out | value);
    } else if (offset == PCOR) {
        bus_put(emu, self, PDOR, out & ~value);
    } else if (offset == PTOR) {
        bus_put(emu, self, PDOR, out ^ value);
    }
}

bool trgmux_models(uint32_t offset)
{
    return offset == 0x28 || offset == TO_PDB0 || offset == TO_PDB1 || offset == TO_LPSPI0 || offset == TO_LPSPI1;
}

uint32_t trgmux_read(emu_t *emu, const peripheral_t *self, uint32_t offset, uint32_t stored)
{
    (void)emu, (void)self, (void)offset;
    return stored;
}

void trgmux_written(emu_t *emu, const peripheral_t *self, uint32_t offset, uint32_t old, uint32_t value)
{
    (void)self;
    if ((old & LOCK) != 0 && old != value) {
        emu_fail(emu, "write of TRGMUX offset 0x%x: the register is locked", offset);
    }
}

void trgmux_event(emu_t *emu, uint32_t source)
{
    const peripheral_t *self = PERIPHERAL(TRGMUX);
    if ((bus_get(emu, self, TO_PDB0) & 0x3FU) == source) {
        pdb_trigger(emu, 0);
    }
    if ((bus_get(emu, self, TO_PDB1) & 0x3FU) == source) {
        pdb_trigger(emu, 1);
    }
}

void trgmux_level(emu_t *emu, uint32_t source, bool level)
{
    static const uint32_t target[2] = {TO_LPSPI0, TO_LPSPI1};
    const peripheral_t *self = PERIPHERAL(TRGMUX);
    for (int instance = 0; instance < 2; instance++) {
        if ((bus_get(emu, self, target[instance]) & 0x3FU) == source) {
            lpspi_request(emu, instance, level);
        }
    }
}
