/* SPDX-License-Identifier: Apache-2.0 */
/* LPSPI as master, and the AD2S1210 resolver-to-digital converter at LPSPI0. A frame is received when all its bits have
 * been clocked; the converter's answer is determined when the frame begins.
 *
 * documented behaviour                               | modelled | test
 * -------------------------------------------------- | -------- | --------------------------------------------
 * master, single frames, FIFOs of four words         | yes      | test_a_frame_arrives_when_its_bits_have_been_clocked
 * frame time from CCR, prescaler and clock           | yes      | test_a_frame_arrives_when_its_bits_have_been_clocked
 * a read of an empty receive FIFO                    | refused  | test_reading_an_empty_fifo_is_refused
 * a frame with a full receive FIFO                   | refused  | test_a_frame_with_a_full_fifo_is_refused
 * interrupts, DMA, continuous and wide transfers     | refused  | test_other_transfer_modes_are_refused
 * AD2S1210: position latched by SAMPLE               | yes      | test_a_resolver_image_computes_the_same_bits
 * AD2S1210: faults kept until read and sampled again | yes      | test_a_fault_of_the_resolver_raises_the_angle_fault
 * AD2S1210: tracking error, dynamics, settling       | no       | -
 */
#include "emu_private.h"

enum {
    CR = 0x10,
    SR = 0x14,
    IER = 0x18,
    DER = 0x1C,
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
};

bool lpspi_models(uint32_t offset)
{
    return offset <= DER || offset == CFGR1 || offset == CCR || offset >= FCR;
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
        return count << 16;
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

static void transfer(emu_t *emu, const peripheral_t *self)
{
    spi_t *spi = &emu->s.spi[self->instance];
    const uint32_t bits = (bus_get(emu, self, TCR) & 0xFFFU) + 1U;
    if ((bus_get(emu, self, CR) & MEN) == 0 || (bus_get(emu, self, CFGR1) & 1U) == 0) {
        emu_fail(emu, "write of %s.TDR: the module is not an enabled master", self->name);
    } else if (bits > 32U || spi->rx_count == FIFO) {
        emu_fail(emu, "write of %s.TDR: %u bits with %d words waiting do not fit", self->name, bits, spi->rx_count);
    } else {
        const uint64_t begin = spi->busy_until > emu->s.now ? spi->busy_until : emu->s.now;
        spi->busy_until = begin + frame_ticks(emu, self, bits);
        const uint32_t no_answer = 0xFFFFFFFFU >> (32U - bits), sent = bus_get(emu, self, TDR);
        spi->rx[spi->rx_count] = self->instance == 0 ? rdc_transfer(emu, sent, bits) : no_answer;
        spi->ready[spi->rx_count++] = spi->busy_until;
    }
}

void lpspi_written(emu_t *emu, const peripheral_t *self, uint32_t offset, uint32_t old, uint32_t value)
{
    spi_t *spi = &emu->s.spi[self->instance];
    if (offset == TDR) {
        transfer(emu, self);
    } else if (offset == CR) {
        spi->rx_count = (value & (RESET | RRF)) != 0 ? 0 : spi->rx_count;
        bus_put(emu, self, CR, value & ~(uint32_t)(RTF | RRF));
        if ((value & MEN) != 0) {
            pins_check(emu, self->name);
        }
    } else if (offset == CFGR1 && (old ^ value) != 0 && (bus_get(emu, self, CR) & MEN) != 0) {
        emu_fail(emu, "write of %s.CFGR1: the module is enabled", self->name);
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
    rdc->latched = emu_angle(emu);
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
uint32_t rdc_transfer(emu_t *emu, uint32_t sent, uint32_t bits)
{
    const uint32_t lines = bus_get(emu, bus_find("PTC"), 0);
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
