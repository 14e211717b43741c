/* SPDX-License-Identifier: Apache-2.0 */
/* DMA controller (eDMA): copies of half words within the memory that the program starts, and links from a channel to
 * the next. Sources: reference manual S32K1xx, chapter eDMA, and those of the Kinetis family, whose controller is the
 * same.
 * A channel copies at the end of its time: a program that reads the destination too early finds the old content, one
 * that changes the source too early finds the change in the copy. That time is an assumption, on the slow side: 16
 * cycles of the system clock for a channel and 8 for each half word. The manual states 4 to start and 3 to end a
 * channel, and 1 for each read and each write without wait states.
 *
 * documented behaviour                             | modelled | test
 * ------------------------------------------------ | -------- | --------------------------------------------
 * START: a minor loop of NBYTES is copied          | yes      | test_a_program_starts_a_copy_and_waits_for_it
 * START reads 0, ACTIVE 1 while the channel runs   | yes      | test_a_channel_is_active_until_it_is_done
 * DONE: cleared by software, by a start            | yes      | test_done_is_cleared_by_software_and_by_a_start
 * the copy takes its time                          | yes      | test_a_copy_arrives_at_the_end_of_its_time
 * its time counts the system clock                 | yes      | test_a_slower_clock_lengthens_a_copy
 * SOFF and DOFF are signed                         | yes      | test_offsets_are_signed
 * a copy overlaps its own source                   | yes      | test_a_copy_may_overlap_its_source
 * SADDR, DADDR end behind the last half word       | yes      | test_the_addresses_move_to_the_end_of_the_copy
 * SLAST and DLASTSGA are added at the end          | yes      | test_the_last_adjustments_are_added
 * MAJORELINK: the end starts another channel       | yes      | test_the_end_of_a_channel_starts_the_linked_one
 * MAJORELINK is written as 0 while DONE is set     | yes      | test_a_link_is_lost_while_done_is_set
 * DONE is undefined after a reset: assumed set     | yes      | test_a_link_is_lost_while_done_is_undefined
 * descriptors are undefined after a reset          | refused  | test_an_incomplete_descriptor_is_refused
 * undefined fields must not be relied on           | refused  | test_an_undefined_field_is_not_read
 * a descriptor in use must not be written          | refused  | test_a_descriptor_in_use_is_not_written
 * an active channel's addresses move               | refused  | test_the_addresses_of_an_active_channel_are_not_read
 * arbitration between channels                     | refused  | test_a_second_channel_is_refused
 * configuration errors: alignment, size, counts    | refused  | test_configuration_errors_are_refused
 * bus errors: addresses without memory             | refused  | test_a_copy_outside_the_memory_is_refused
 * RAM that is retained must not be accessed        | refused  | test_a_copy_of_retained_ram_is_refused
 * other sizes, modulo, several minor loops         | refused  | test_other_transfers_are_refused
 * interrupts, scatter-gather, DREQ, BWC            | refused  | test_other_controls_are_refused
 * requests by hardware, priorities, EMLM, CDNE     | refused  | test_other_controls_are_refused
 * one access to two fields of a descriptor         | refused  | test_two_fields_are_not_written_at_once
 * ES and ERR: what fails is refused before         | yes      | test_no_error_is_reported
 * code that has been copied runs                   | yes      | test_copied_code_runs
 * a reset ends a copy                              | yes      | test_a_reset_ends_a_copy
 * a part of the copy that a reset leaves           | no       | -
 * waiting for the bus: core and DMA at one memory  | no       | -
 */
#include "emu_private.h"

enum {
    CR = 0x00,
    ES = 0x04,
    ERQ = 0x0C,
    ERR = 0x2C,
    DESCRIPTORS = 0x1000,
    DESCRIPTOR_SIZE = 0x20,
    SADDR = 0x00, /* within a descriptor */
    SOFF = 0x04,
    ATTR = 0x06,
    NBYTES = 0x08,
    SLAST = 0x0C,
    DADDR = 0x10,
    DOFF = 0x14,
    CITER = 0x16,
    DLASTSGA = 0x18,
    CSR = 0x1C,
    BITER = 0x1E,
    EVERY_FIELD = 0xDD5D, /* bit k: the field at offset 2 k */
    START = 0x01,
    MAJORELINK = 0x20,
    ACTIVE = 0x40,
    DONE = 0x80,
    LINK_SHIFT = 8,
    LINK_MASK = 0xF,
    WRITABLE = LINK_MASK << LINK_SHIFT | MAJORELINK | START, /* as far as modelled */
    HALF_WORDS = 0x0101,
    HALF_WORD = 2,
    CHANNEL_CYCLES = 16,
    HALF_WORD_CYCLES = 8,
};

typedef struct {
    uint32_t source, destination, count;
    int32_t source_step, destination_step;
} copy_t;

bool dma_models(uint32_t offset)
{
    return offset >= DESCRIPTORS || offset == CR || offset == ES || offset == ERQ || offset == ERR;
}

static uint32_t field(const emu_t *emu, uint32_t channel, uint32_t at)
{
    return bus_get(emu, PERIPHERAL(DMA), DESCRIPTORS + channel * DESCRIPTOR_SIZE + at);
}

static void field_put(emu_t *emu, uint32_t channel, uint32_t at, uint32_t value)
{
    bus_put(emu, PERIPHERAL(DMA), DESCRIPTORS + channel * DESCRIPTOR_SIZE + at, value);
}

static copy_t copy_of(const emu_t *emu, uint32_t channel)
{
    return (copy_t){.source = field(emu, channel, SADDR),
                    .destination = field(emu, channel, DADDR),
                    .count = field(emu, channel, NBYTES) / HALF_WORD,
                    .source_step = (int16_t)field(emu, channel, SOFF),
                    .destination_step = (int16_t)field(emu, channel, DOFF)};
}

/* The channel is active, or a link of the active one will start it. */
static bool is_in_use(const emu_t *emu, uint32_t channel)
{
    bool linked = emu->s.dma.active != 0U;
    uint32_t at = emu->s.dma.active - 1U;
    for (int k = 0; linked && k < DMA_CHANNELS; k++) {
        if (at == channel) {
            return true;
        }
        const uint32_t csr = field(emu, at, CSR);
        linked = (csr & MAJORELINK) != 0U;
        at = csr >> LINK_SHIFT & LINK_MASK;
    }
    return false;
}

uint32_t dma_read(emu_t *emu, const peripheral_t *self, uint32_t offset, uint32_t stored)
{
    (void)self;
    if (offset < DESCRIPTORS) {
        return stored;
    }
    const uint32_t channel = (offset - DESCRIPTORS) / DESCRIPTOR_SIZE, at = offset % DESCRIPTOR_SIZE;
    if ((emu->s.dma.written[channel] >> at / 2U & 1U) == 0U) {
        emu_fail(emu, "read of DMA offset 0x%x: the descriptor's field is undefined, it has not been written", offset);
    } else if (emu->s.dma.active == channel + 1U && (at == SADDR || at == DADDR || at == NBYTES)) {
        emu_fail(emu, "read of DMA offset 0x%x: its value while the channel is active is not modelled", offset);
    }
    return stored;
}

/* ---- a channel ---- */

static bool lies_in(uint32_t base, uint32_t size, uint32_t first, int32_t step, uint32_t count)
{
    const int64_t from = (int64_t)first - base, last = from + (int64_t)step * (count - 1U);
    return from >= 0 && last >= 0 && from <= (int64_t)size - HALF_WORD && last <= (int64_t)size - HALF_WORD;
}

static bool reaches_upper(uint32_t first, int32_t step, uint32_t count)
{
    const int64_t last = (int64_t)first + (int64_t)step * (count - 1U);
    return first >= RAM_UPPER || last >= RAM_UPPER;
}

static bool is_closed(const emu_t *emu, const copy_t *c)
{
    return emu->s.upper_retained && (reaches_upper(c->source, c->source_step, c->count) ||
                                     reaches_upper(c->destination, c->destination_step, c->count));
}

/* What the manual calls a configuration error or a bus error, and what is not modelled; NULL: nothing. */
static const char *refusal(const emu_t *emu, uint32_t channel)
{
    const copy_t c = copy_of(emu, channel);
    const uint32_t bytes = field(emu, channel, NBYTES);
    if (emu->s.dma.written[channel] != EVERY_FIELD) {
        return "a field of its descriptor has not been written since the reset";
    }
    if (field(emu, channel, ATTR) != HALF_WORDS) {
        return "only half words without modulo are modelled (ATTR)";
    }
    if (field(emu, channel, CITER) != 1U || field(emu, channel, BITER) != 1U) {
        return "only one minor loop without a link is modelled (CITER = BITER = 1)";
    }
    if (bytes == 0U || bytes % HALF_WORD != 0U || bytes > RAM_SIZE) {
        return "NBYTES is 0, odd or more than the RAM";
    }
    if (((c.source | c.destination | (uint32_t)c.source_step | (uint32_t)c.destination_step) & 1U) != 0U) {
        return "an address or an offset is odd";
    }
    if (!lies_in(0, FLASH_SIZE, c.source, c.source_step, c.count) &&
        !lies_in(RAM_BASE, RAM_SIZE, c.source, c.source_step, c.count)) {
        return "the source lies neither in the flash nor in the RAM";
    }
    if (!lies_in(RAM_BASE, RAM_SIZE, c.destination, c.destination_step, c.count)) {
        return "the destination does not lie in the RAM";
    }
    if (is_closed(emu, &c)) {
        return "SIM.CHIPCTL.SRAMU_RETEN keeps its RAM from being accessed";
    }
    return NULL;
}

static void begin(emu_t *emu, uint32_t channel)
{
    dma_t *dma = &emu->s.dma;
    const char *refused = refusal(emu, channel);
    if (dma->active != 0U) {
        emu_fail(emu, "DMA channel %u starts while channel %u is active: arbitration is not modelled", channel,
                 dma->active - 1U);
    } else if (refused != NULL) {
        emu_fail(emu, "DMA channel %u starts: %s", channel, refused);
    } else {
        const uint64_t cycles = CHANNEL_CYCLES + (uint64_t)HALF_WORD_CYCLES * copy_of(emu, channel).count;
        dma->active = (uint8_t)(channel + 1U);
        field_put(emu, channel, CSR, (field(emu, channel, CSR) & ~(uint32_t)DONE) | ACTIVE);
        emu_timer(emu, TIMER_DMA, emu_instant(emu) + cycles * emu->s.core_ticks);
    }
}

/* One half word after the other, as the controller does: a copy may overlap its source. */
static void copy(emu_t *emu, copy_t c)
{
    for (uint32_t k = 0; k < c.count; k++) {
        uint8_t half_word[HALF_WORD];
        (void)uc_mem_read(emu->uc, c.source, half_word, sizeof half_word);
        (void)emu_memory_write(emu, c.destination, half_word, sizeof half_word);
        c.source += (uint32_t)c.source_step;
        c.destination += (uint32_t)c.destination_step;
    }
}

void dma_fire(emu_t *emu)
{
    const uint32_t channel = emu->s.dma.active - 1U;
    const copy_t c = copy_of(emu, channel);
    if (is_closed(emu, &c)) { /* since the channel has begun */
        emu_fail(emu, "DMA channel %u runs: SIM.CHIPCTL.SRAMU_RETEN keeps its RAM from being accessed", channel);
        return;
    }
    copy(emu, c);
    field_put(emu, channel, SADDR, c.source + c.count * (uint32_t)c.source_step + field(emu, channel, SLAST));
    field_put(emu, channel, DADDR,
              c.destination + c.count * (uint32_t)c.destination_step + field(emu, channel, DLASTSGA));
    const uint32_t csr = field(emu, channel, CSR);
    field_put(emu, channel, CSR, (csr & ~(uint32_t)ACTIVE) | DONE);
    emu->s.dma.active = 0;
    if ((csr & MAJORELINK) != 0U) {
        begin(emu, csr >> LINK_SHIFT & LINK_MASK);
    }
}

/* ---- writes ---- */

static void csr_written(emu_t *emu, uint32_t channel, bool done, uint32_t value)
{
    if ((value & ~(uint32_t)WRITABLE) != 0U) {
        emu_fail(emu,
                 "write of DMA.TCD%u_CSR: 0x%04x: only START and the link to a channel are modelled; DONE and ACTIVE "
                 "are written as 0",
                 channel, value);
        return;
    }
    field_put(emu, channel, CSR, value & ~(done ? (uint32_t)(START | MAJORELINK) : (uint32_t)START));
    if ((value & START) != 0U) {
        begin(emu, channel);
    }
}

void dma_written(emu_t *emu, const peripheral_t *self, uint32_t offset, uint32_t old, uint32_t value)
{
    if (offset == ERR) {
        bus_put(emu, self, ERR, 0); /* no channel ends with an error: each is refused */
    } else if (offset < DESCRIPTORS && value != 0U) {
        emu_fail(emu, "write of DMA offset 0x%x: hardware requests, priorities and EMLM are not modelled", offset);
    }
    if (offset < DESCRIPTORS) {
        return;
    }
    const uint32_t channel = (offset - DESCRIPTORS) / DESCRIPTOR_SIZE, at = offset % DESCRIPTOR_SIZE;
    uint16_t *written = &emu->s.dma.written[channel];
    const uint16_t bit = (uint16_t)(1U << at / 2U);
    const bool done = (*written & bit) == 0U || (old & DONE) != 0U; /* of CSR */
    if (is_in_use(emu, channel)) {
        emu_fail(emu, "write of DMA offset 0x%x: channel %u is active or will be started by a link", offset, channel);
        return;
    }
    *written |= bit;
    if (at == CSR) {
        csr_written(emu, channel, done, value);
    }
}
