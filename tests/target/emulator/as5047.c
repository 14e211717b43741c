/* SPDX-License-Identifier: Apache-2.0 */
/* The AS5047P magnetic encoder at LPSPI0, of an image that was built for it. Each frame brings the answer to the one
 * before; the addressed register is sampled when the chip select rises.
 *
 * documented behaviour                               | modelled | test
 * -------------------------------------------------- | -------- | --------------------------------------------
 * answers one frame later, sampled at its end        | yes      | test_the_as5047_image_passes_each_check
 * even parity of answers and commands, EF            | yes      | test_the_as5047_image_passes_each_check
 * ERRFL: kept until read                             | yes      | test_a_planted_error_of_the_as5047_is_found
 * DIAAGC: field too weak                             | yes      | test_the_as5047_image_passes_each_check
 * 10 MHz; 350 ns from the select, between frames     | refused  | test_a_planted_error_of_the_as5047_is_found
 * frames of 16 bits; other registers; writing        | refused  | test_a_planted_error_of_the_as5047_is_found
 * delay of the angle, its rate of 222 kHz, noise     | no       | -
 */
#include "emu_private.h"

enum {
    BITS = 16,
    CCR = 0x40,
    BIT_TICKS = 336,     /* 100 ns */
    SELECT_TICKS = 1176, /* 350 ns */
    PARITY = 0x8000,
    EF = 0x4000,
    ERRFL = 0x4001, /* reading, with the command's parity */
    DIAAGC = 0xFFFC,
    ANGLECOM = 0xFFFF,
    FRAMING_ERROR = 1,
    COMMAND_PARITY_ERROR = 4,
    SETTLED = 0x180,
    TOO_WEAK = 0x800,
};

void as5047_power_on(emu_t *emu)
{
    emu->s.as5047 = (as5047_t){.errors = FRAMING_ERROR, .fault = emu->s.as5047.fault};
}

static bool odd(uint32_t word)
{
    return (__builtin_popcount(word) & 1) != 0;
}

static uint32_t register_read(emu_t *emu, uint32_t command, uint64_t end)
{
    as5047_t *device = &emu->s.as5047;
    uint32_t content = 0;
    switch (command) {
    case ERRFL:
        content = device->errors;
        device->errors = 0;
        return content;
    case DIAAGC:
        return SETTLED | (device->fault == EMU_ENCODER_WEAK_FIELD ? TOO_WEAK : 0U);
    case ANGLECOM:
        return emu_angle_at(emu, end) >> 18;
    default:
        emu_fail(emu, "the AS5047P is asked 0x%04x: not modelled", command);
        return 0;
    }
}

static uint32_t on_the_line(const as5047_t *device)
{
    const uint32_t content = device->answer | (device->errors != 0U || device->fault == EMU_ENCODER_EF ? EF : 0U);
    const uint32_t frame = content | (odd(content) ? PARITY : 0U);
    switch (device->fault) {
    case EMU_ENCODER_PARITY:
        return frame ^ 0x400U;
    case EMU_ENCODER_LOW:
        return 0;
    case EMU_ENCODER_HIGH:
        return 0xFFFFU;
    default:
        return frame;
    }
}

static void check_timing(emu_t *emu)
{
    const peripheral_t *spi = PERIPHERAL(LPSPI0);
    const uint32_t clock = clocks_peripheral_ticks(emu, spi->gate), ccr = bus_get(emu, spi, CCR);
    if (clock * ((ccr & 0xFFU) + 2U) < BIT_TICKS || clock * ((ccr >> 16 & 0xFFU) + 1U) < SELECT_TICKS ||
        clock * ((ccr >> 8 & 0xFFU) + 2U) < SELECT_TICKS) {
        emu_fail(emu, "the AS5047P is read faster than 10 MHz, or with less than 350 ns before or between frames");
    }
}

uint32_t as5047_transfer(emu_t *emu, uint64_t end, uint32_t sent, uint32_t bits)
{
    as5047_t *device = &emu->s.as5047;
    check_timing(emu);
    if (bits != BITS) {
        emu_fail(emu, "the AS5047P takes frames of 16 bits, not %u", bits);
        return 0;
    }
    const uint32_t frame = on_the_line(device);
    if (odd(sent & 0xFFFFU)) {
        device->errors |= COMMAND_PARITY_ERROR;
        device->answer = 0;
    } else {
        device->answer = (uint16_t)register_read(emu, sent & 0xFFFFU, end);
    }
    return frame;
}
