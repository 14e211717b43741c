/* SPDX-License-Identifier: Apache-2.0 */
/* LPSPI as master, and the AD2S1210 resolver-to-digital converter at LPSPI0 (the other device there: as5047.c). A frame
 * is received when all its bits have been clocked; the converter's answer is determined when the frame begins. With the
 * host request enabled a word waits in the FIFO until the request rises; three clocks are assumed for its
 * synchronisation.
 *
 * documented behaviour                               | modelled | test
 * -------------------------------------------------- | -------- | --------------------------------------------
 * master, single frames, FIFOs of four words         | yes      | test_a_frame_arrives_when_its_bits_have_been_clocked
 * frame time from CCR, prescaler and clock           | yes      | test_a_frame_arrives_when_its_bits_have_been_clocked
 * a read of an empty receive FIFO                    | refused  | test_reading_an_empty_fifo_is_refused
 * a frame with a full receive FIFO                   | refused  | test_a_frame_with_a_full_fifo_is_refused
 * host request by the input trigger                  | yes      | test_a_request_starts_one_frame_per_pulse
 * a request shorter than a clock of the module       | refused  | test_a_request_that_is_too_short_is_refused
 * interrupts, DMA, continuous and wide transfers     | refused  | test_other_transfer_modes_are_refused
 * AD2S1210: position latched by SAMPLE, 14 bits      | yes      | test_a_resolver_image_computes_the_same_bits
 * AD2S1210: read sooner than 6 clocks after SAMPLE   | refused  | test_a_planted_error_of_the_angle_is_found
 * AD2S1210: faults kept until read and sampled again | yes      | test_a_fault_of_the_resolver_raises_the_angle_fault
 * AD2S1210: tracking error, dynamics, settling       | no       | -
 */
#include "emu_private.h"

enum {
    CR = 0x10,
    SR = 0x14,
    IER = 0x18,
    DER = 0x1C,
    CFGR0 = 0x20,
    CFGR1 = 0x24,
    CCR = 0x40,
    FCR = 0x58,
    FSR = 0x5C,
    TCR = 0x60,
    TDR = 0x64,
    RSR = 0x70,
    RDR = 0x74,
    FIFO = 4,
    MEN = 1,
    RESET = 2,
    RTF = 1 << 8,
    RRF = 1 << 9,
    HREN = 1,
    BY_TRIGGER = 7, /* HREN, active high, input trigger */
    REQUEST_CLOCKS = 3,
    RDC_READY = 2528, /* ticks: 6 periods of 8.192 MHz and 20 ns, AD2S1210 data sheet, timing, t17 */
};

bool lpspi_models(uint32_t offset)
{
    return offset <= CFGR1 || offset == CCR || offset >= FCR;
}

static uint32_t arrived(const emu_t *emu, const spi_t *spi)
{
    uint32_t count = 0;
    while (count < (uint32_t)spi->rx_count && spi->ready[count] <= emu->s.now) {
        count++;
    }
    return count;
}

static uint32_t receive(emu_t *emu, const peripheral_t *self)
{
    spi_t *spi = &emu->s.spi[self->instance];
    if (arrived(emu, spi) == 0) {
        emu_fail(emu, "read of %s.RDR: nothing has been received", self->name);
        return 0;
    }
    const uint32_t word = spi->rx[0];
    spi->rx_count--;
    for (int i = 0; i < spi->rx_count; i++) {
        spi->rx[i] = spi->rx[i + 1];
        spi->ready[i] = spi->ready[i + 1];
    }
    return word;
}

uint32_t lpspi_read(emu_t *emu, const peripheral_t *self, uint32_t offset, uint32_t stored)
{
    spi_t *spi = &emu->s.spi[self->instance];
    const uint32_t count = arrived(emu, spi);
    switch (offset) {
    case SR:
        return 1U | (count > (bus_get(emu, self, FCR) >> 16 & 3U) ? 2U : 0U) |
               (emu->s.now < spi->busy_until ? 1U << 24 : 0U);
    case FSR:
        return count << 16 | (uint32_t)spi->tx_count;
    case RSR:
        return count == 0 ? 2U : 0U;
    case RDR:
        return receive(emu, self);
    default:
        return stored;
    }
}

static uint64_t frame_ticks(emu_t *emu, const peripheral_t *self, uint32_t bits)
{
    const uint32_t clock = clocks_peripheral_ticks(emu, self->gate) << (bus_get(emu, self, TCR) >> 27 & 7U);
    const uint32_t ccr = bus_get(emu, self, CCR);
    const uint32_t gaps = (ccr >> 8 & 0xFFU) + (ccr >> 16 & 0xFFU) + (ccr >> 24 & 0xFFU) + 4U;
    if (clock == 0) {
        emu_fail(emu, "%s transfers without a clock (PCC, SCG divider 2)", self->name);
    }
    return (uint64_t)clock * (bits * ((ccr & 0xFFU) + 2U) + gaps);
}

static uint32_t frame_bits(const emu_t *emu, const peripheral_t *self)
{
    return (bus_get(emu, self, TCR) & 0xFFFU) + 1U;
}

static void transfer(emu_t *emu, const peripheral_t *self, uint64_t earliest, uint32_t sent)
{
    spi_t *spi = &emu->s.spi[self->instance];
    const uint32_t bits = frame_bits(emu, self);
    const uint64_t begin = spi->busy_until > earliest ? spi->busy_until : earliest;
    spi->busy_until = begin + frame_ticks(emu, self, bits);
    const uint32_t no_answer = 0xFFFFFFFFU >> (32U - bits);
    spi->rx[spi->rx_count] = self->instance != 0 ? no_answer
                             : emu->as5047       ? as5047_transfer(emu, spi->busy_until, sent, bits)
                                                 : rdc_transfer(emu, begin, sent, bits);
    spi->ready[spi->rx_count++] = spi->busy_until;
}

/* The first word that waits; a full receive FIFO stalls the module. */
static bool next_waiting(emu_t *emu, const peripheral_t *self, uint64_t earliest)
{
    spi_t *spi = &emu->s.spi[self->instance];
    if (spi->tx_count == 0 || spi->rx_count == FIFO) {
        return false;
    }
    const uint32_t sent = spi->tx[0];
    spi->tx_count--;
    for (int i = 0; i < spi->tx_count; i++) {
        spi->tx[i] = spi->tx[i + 1];
    }
    transfer(emu, self, earliest, sent);
    return true;
}

/* A further frame begins as long as the request lasts. */
static void request_ended(emu_t *emu, const peripheral_t *self, uint64_t now)
{
    spi_t *spi = &emu->s.spi[self->instance];
    if (now - spi->requested_at <= clocks_peripheral_ticks(emu, self->gate)) {
        emu_fail(emu, "%s: the request is not longer than a clock of the module and may be missed", self->name);
    }
    while (spi->busy_until < now && next_waiting(emu, self, spi->busy_until)) {
    }
}

void lpspi_request(emu_t *emu, int instance, bool level)
{
    const peripheral_t *self = instance == 0 ? PERIPHERAL(LPSPI0) : PERIPHERAL(LPSPI1);
    spi_t *spi = &emu->s.spi[instance];
    const uint64_t now = emu_instant(emu);
    if (level == spi->requested || (bus_get(emu, self, CFGR0) & HREN) == 0 || (bus_get(emu, self, CR) & MEN) == 0) {
        return;
    }
    spi->requested = level;
    if (level) {
        spi->requested_at = now;
        (void)next_waiting(emu, self, now + (uint64_t)REQUEST_CLOCKS * clocks_peripheral_ticks(emu, self->gate));
    } else {
        request_ended(emu, self, now);
    }
}

static void word_written(emu_t *emu, const peripheral_t *self)
{
    spi_t *spi = &emu->s.spi[self->instance];
    const bool waits = (bus_get(emu, self, CFGR0) & HREN) != 0;
    const uint32_t bits = frame_bits(emu, self);
    if ((bus_get(emu, self, CR) & MEN) == 0 || (bus_get(emu, self, CFGR1) & 1U) == 0) {
        emu_fail(emu, "write of %s.TDR: the module is not an enabled master", self->name);
    } else if (bits > 32U || (waits ? spi->tx_count : spi->rx_count) == FIFO) {
        emu_fail(emu, "write of %s.TDR: %u bits with %d words waiting do not fit", self->name, bits,
                 waits ? spi->tx_count : spi->rx_count);
    } else if (!waits) {
        transfer(emu, self, emu->s.now, bus_get(emu, self, TDR));
    } else {
        spi->tx[spi->tx_count++] = bus_get(emu, self, TDR);
        if (spi->requested) {
            (void)next_waiting(emu, self, emu->s.now);
        }
    }
}

void lpspi_written(emu_t *emu, const peripheral_t *self, uint32_t offset, uint32_t old, uint32_t value)
{
    spi_t *spi = &emu->s.spi[self->instance];
    if (offset == TDR) {
        word_written(emu, self);
    } else if (offset == CR) {
        spi->rx_count = (value & (RESET | RRF)) != 0 ? 0 : spi->rx_count;
        spi->tx_count = (value & (RESET | RTF)) != 0 ? 0 : spi->tx_count;
        bus_put(emu, self, CR, value & ~(uint32_t)(RTF | RRF));
        if ((value & MEN) != 0) {
            pins_check(emu, self);
        }
    } else if (offset == CFGR1 && (old ^ value) != 0 && (bus_get(emu, self, CR) & MEN) != 0) {
        emu_fail(emu, "write of %s.CFGR1: the module is enabled", self->name);
    } else if (offset == CFGR0 && (value & HREN) != 0 && (value != BY_TRIGGER || (bus_get(emu, self, CR) & MEN) != 0)) {
        emu_fail(emu,
                 "write of %s.CFGR0: only a request by the input trigger, active high, set while the module is "
                 "disabled, is modelled",
                 self->name);
    } else if ((offset == IER || offset == DER) && value != 0) {
        emu_fail(emu, "write of %s offset 0x%x: interrupts and DMA are not modelled", self->name, offset);
    } else if (offset == TCR && (value & 0x00FF0000U) != 0) {
        emu_fail(emu, "write of %s.TCR: only single frames on one wire, most significant bit first", self->name);
    }
}

/* ---- the converter at LPSPI0 ---- */

/* After power-up the fault register reports loss of signal and loss of tracking, from the time without signals. */
void rdc_power_on(emu_t *emu)
{
    emu->s.rdc.fault = 0x48;
}

/* SAMPLE falls: position and faults are latched; faults that have been read are cleared, unless they persist. */
void rdc_sample(emu_t *emu)
{
    rdc_t *rdc = &emu->s.rdc;
    rdc->latched = emu_angle(emu) & 0xFFFC0000U; /* 14 bits: the resolution pins of hal/s32k144/README.md */
    rdc->sampled_at = emu_instant(emu);
    rdc->fault = rdc->read ? 0U : rdc->fault;
    rdc->read = false;
    rdc->fault |= emu->s.pins.resolver_fault ? 0x40U : 0U;
    rdc->sampled_fault = rdc->fault;
}

/* Configuration mode, frames of eight bits: an address, then the content of that register. Only the fault register is
 * modelled. */
static uint32_t rdc_configure(emu_t *emu, uint32_t sent, uint32_t bits)
{
    rdc_t *rdc = &emu->s.rdc;
    if (bits != 8U || (sent & 0xFFU) != 0xFFU) {
        emu_fail(emu, "the AD2S1210 is in its configuration mode: only its fault register is modelled");
        return 0;
    }
    rdc->read = rdc->address == 0xFFU;
    const uint32_t answer = rdc->read ? rdc->sampled_fault : 0U;
    rdc->address = rdc->read ? 0U : (uint8_t)sent;
    return answer;
}

/* Normal mode: A1 = 0 position, A1 = 1 velocity; then the fault register. Latched by SAMPLE. */
uint32_t rdc_transfer(emu_t *emu, uint64_t begin, uint32_t sent, uint32_t bits)
{
    if (begin < emu->s.rdc.sampled_at + RDC_READY) {
        emu_fail(emu, "the AD2S1210 is read sooner than 6 of its clocks after SAMPLE fell");
    }
    const uint32_t lines = bus_get(emu, PERIPHERAL(PTC), 0);
    const bool a0 = (lines >> EMU_RDC_A0 & 1U) != 0, a1 = (lines >> EMU_RDC_A1 & 1U) != 0;
    if (a0 && a1) {
        return rdc_configure(emu, sent, bits);
    }
    if (a0) {
        emu_fail(emu, "the AD2S1210 has no mode A0 = 1, A1 = 0");
        return 0;
    }
    const double turns_per_s = (double)emu->s.pins.angle_rate / 65536.0 / 4294967296.0 * (double)EMU_TICKS_PER_S;
    const uint32_t value = a1 ? (uint32_t)(int32_t)(turns_per_s / 500.0 * 32768.0) & 0xFFFFU : emu->s.rdc.latched >> 16;
    const uint32_t frame = value << 8 | emu->s.rdc.sampled_fault;
    return bits >= 24U ? frame << (bits - 24U) : frame >> (24U - bits);
}
