/* SPDX-License-Identifier: Apache-2.0 */
/* Every access to a peripheral is checked here: the register must exist, be modelled and clocked, and reserved bits
 * must keep their reset values. */
#include <stdlib.h>
#include <string.h>

#include "emu_private.h"

enum { PAGE = 0x1000, GPIO_PAGE = 0xFF, GPIO_STEP = 0x40 };

#define ROW(name, kind, gate, instance, narrow) \
    [PERIPHERAL_##name] = {#name, kind##_models, kind##_read, kind##_written, gate, instance, narrow}

/* clang-format off */
const peripheral_t peripherals[] = {
    ROW(SCG,    scg,    0,     0, false),
    ROW(PCC,    pcc,    0,     0, false),
    ROW(SMC,    smc,    0,     0, false),
    ROW(PMC,    pmc,    0,     0, false),
    ROW(RCM,    rcm,    0,     0, false),
    ROW(SIM,    sim,    0,     0, false),
    ROW(TRGMUX, trgmux, 0,     0, false),
    ROW(FTM0,   ftm,    0xE0,  0, false),
    ROW(FTM2,   ftm,    0xE8,  1, false),
    ROW(PDB0,   pdb,    0xD8,  0, false),
    ROW(PDB1,   pdb,    0xC4,  1, false),
    ROW(ADC0,   adc,    0xEC,  0, false),
    ROW(ADC1,   adc,    0x9C,  1, false),
    ROW(LPIT0,  lpit,   0xDC,  0, false),
    ROW(LPSPI0, lpspi,  0xB0,  0, false),
    ROW(LPSPI1, lpspi,  0xB4,  1, false),
    ROW(LPSPI2, lpspi,  0xB8,  2, false),
    ROW(CAN0,   can,    0x90,  0, true),
    ROW(WDOG,   wdog,   0,     0, false),
    ROW(PORTA,  port,   0x124, 0, false),
    ROW(PORTB,  port,   0x128, 1, false),
    ROW(PORTC,  port,   0x12C, 2, false),
    ROW(PORTD,  port,   0x130, 3, false),
    ROW(PORTE,  port,   0x134, 4, false),
    ROW(PTA,    gpio,   0,     0, false),
    ROW(PTB,    gpio,   0,     1, false),
    ROW(PTC,    gpio,   0,     2, false),
    ROW(PTD,    gpio,   0,     3, false),
    ROW(PTE,    gpio,   0,     4, false),
    ROW(LMEM,   lmem,   0,     0, false),
    ROW(FTFC,   ftfc,   0x80,  0, false),
    ROW(MSCM,   mscm,   0,     0, false),
    ROW(DMA,    dma,    0,     0, false),
};
/* clang-format on */
const int peripherals_count = (int)(sizeof peripherals / sizeof peripherals[0]);

static const facts_t *facts_named(const char *name)
{
    for (int i = 0; i < facts_count; i++) {
        if (strcmp(facts[i].name, name) == 0) {
            return &facts[i];
        }
    }
    return NULL;
}

/* Addresses that belong to the peripheral: whole pages, up to its last register. */
static uint32_t span_of(const facts_t *of)
{
    return ((uint32_t)of->fact[of->count - 1].offset / PAGE + 1U) * PAGE;
}

/* On the peripheral bus; of several in one page the first counts. */
static void pages_take(emu_t *emu, int p)
{
    const facts_t *of = emu->facts_of[p];
    for (uint32_t at = 0; (of->base >> 28) == 4U && at < span_of(of); at += PAGE) {
        const uint32_t page = ((of->base + at) / PAGE) & 0xFFU;
        if (emu->page[page] < 0) {
            emu->page[page] = (int16_t)p;
        }
    }
}

bool bus_create(emu_t *emu)
{
    memset(emu->page, 0xFF, sizeof emu->page);
    for (int p = 0; p < peripherals_count; p++) {
        const facts_t *of = facts_named(peripherals[p].name);
        int16_t *index = of != NULL ? malloc(span_of(of) * sizeof *index) : NULL;
        if (of == NULL || index == NULL || of->count > REGISTERS_MAX) {
            free(index);
            return false;
        }
        memset(index, 0xFF, span_of(of) * sizeof *index);
        for (int r = of->count - 1; r >= 0; r--) {
            index[of->fact[r].offset] = (int16_t)r; /* of several at one offset the first, the widest, counts */
        }
        emu->facts_of[p] = of;
        emu->index_of[p] = index;
        pages_take(emu, p);
    }
    return true;
}

void bus_destroy(emu_t *emu)
{
    for (int p = 0; p < peripherals_count; p++) {
        free(emu->index_of[p]);
    }
}

void bus_reset(emu_t *emu)
{
    for (int p = 0; p < peripherals_count; p++) {
        for (int r = 0; r < emu->facts_of[p]->count; r++) {
            emu->s.value[p][r] = emu->facts_of[p]->fact[r].reset;
        }
    }
    bus_put(emu, PERIPHERAL(RCM), 8, emu->s.reset_cause != 0 ? emu->s.reset_cause : 0x82U);
}

uint32_t bus_get(const emu_t *emu, const peripheral_t *peripheral, uint32_t offset)
{
    const int p = (int)(peripheral - peripherals);
    return emu->s.value[p][emu->index_of[p][offset]];
}

void bus_put(emu_t *emu, const peripheral_t *peripheral, uint32_t offset, uint32_t value)
{
    const int p = (int)(peripheral - peripherals);
    emu->s.value[p][emu->index_of[p][offset]] = value;
}

typedef struct {
    const peripheral_t *peripheral;
    const fact_t *fact;
    uint32_t *value;
    uint32_t shift; /* position of a narrow access within its register */
} place_t;

static bool clocked(const emu_t *emu, const peripheral_t *peripheral)
{
    const uint32_t cgc = 1U << 30;
    return peripheral->gate == 0 || (bus_get(emu, PERIPHERAL(PCC), peripheral->gate) & cgc) != 0;
}

bool bus_unclocked(const emu_t *emu, uint32_t address)
{
    const int p = (address >> 20) == 0x400U ? emu->page[address / PAGE & 0xFFU] : -1;
    return p >= 0 && !clocked(emu, &peripherals[p]);
}

/* False: the access is refused, and the emulation stops with the reason. */
static bool find(emu_t *emu, int p, uint32_t address, uint32_t size, const char *what, place_t *place)
{
    const peripheral_t *peripheral = &peripherals[p];
    const uint32_t offset = address - emu->facts_of[p]->base;
    const uint32_t span = span_of(emu->facts_of[p]);
    int16_t r = offset < span ? emu->index_of[p][offset] : -1;
    place->shift = 0;
    if (r < 0 && offset < span) {
        r = emu->index_of[p][offset & ~3U];
        place->shift = 8U * (offset & 3U);
    }
    if (r < 0) {
        emu_fail(emu, "%s of %s offset 0x%x: there is no register", what, peripheral->name, offset);
        return false;
    }
    const fact_t *fact = &emu->facts_of[p]->fact[r];
    place->peripheral = peripheral;
    place->fact = fact;
    place->value = &emu->s.value[p][r];
    if (!peripheral->models(fact->offset)) {
        emu_fail(emu, "%s of %s.%s offset 0x%x: the register is not modelled", what, peripheral->name, fact->name,
                 offset);
    } else if (!clocked(emu, peripheral)) {
        emu_fail(emu, "%s of %s.%s offset 0x%x: the peripheral's clock is off (PCC)", what, peripheral->name,
                 fact->name, offset);
    } else if (place->shift + 8U * size > 8U * fact->bytes) {
        emu_fail(emu, "%s of %s.%s offset 0x%x: %u bytes, the register has %u", what, peripheral->name, fact->name,
                 offset, size, (unsigned)fact->bytes);
    } else {
        return true;
    }
    return false;
}

static int peripheral_at(emu_t *emu, uint32_t address, const char *what)
{
    const uint32_t page = (address / PAGE) & 0xFFU;
    int p = emu->page[page];
    if (page == GPIO_PAGE && p >= 0) {
        p = (address % PAGE) / GPIO_STEP < 5U ? p + (int)((address % PAGE) / GPIO_STEP) : -1;
    }
    if (p < 0) {
        emu_fail(emu, "%s of 0x%08x: no peripheral is modelled there", what, address);
    }
    return p;
}

static uint32_t place_read(emu_t *emu, const place_t *place, uint32_t size)
{
    const peripheral_t *peripheral = place->peripheral;
    const uint32_t word = peripheral->read(emu, peripheral, place->fact->offset, *place->value) >> place->shift;
    return size == 4U ? word : word & ((1U << (8U * size)) - 1U);
}

static void place_write(emu_t *emu, const place_t *place, uint32_t size, uint32_t value)
{
    const fact_t *fact = place->fact;
    const uint32_t old = *place->value;
    if (size < fact->bytes) {
        if (!place->peripheral->narrow) {
            emu_fail(emu, "write of %s.%s offset 0x%x: %u bytes, the register has %u", place->peripheral->name,
                     fact->name, (unsigned)fact->offset, size, (unsigned)fact->bytes);
            return;
        }
        const uint32_t mask = ((1U << (8U * size)) - 1U) << place->shift;
        value = (old & ~mask) | ((value << place->shift) & mask);
    }
    const uint32_t all = fact->bytes == 4U ? 0xFFFFFFFFU : (1U << (8U * fact->bytes)) - 1U;
    const uint32_t reserved = all & ~fact->fields;
    if ((value & reserved) != (fact->reset & reserved)) {
        emu_fail(emu, "write of %s.%s offset 0x%x: 0x%08x changes the reserved bits 0x%08x", place->peripheral->name,
                 fact->name, (unsigned)fact->offset, value, (value ^ fact->reset) & reserved);
        return;
    }
    *place->value = (old & ~fact->writable) | (value & fact->writable);
    place->peripheral->written(emu, place->peripheral, fact->offset, old, value);
}

static uint64_t read_at(emu_t *emu, int p, uint32_t address, unsigned size)
{
    place_t place;
    return p >= 0 && find(emu, p, address, size, "read", &place) ? place_read(emu, &place, size) : 0U;
}

static void write_at(emu_t *emu, int p, uint32_t address, unsigned size, uint32_t value)
{
    place_t place;
    if (p >= 0 && find(emu, p, address, size, "write", &place)) {
        place_write(emu, &place, size, value);
    }
}

uint64_t bus_read(uc_engine *uc, uint64_t offset, unsigned size, void *user)
{
    (void)uc;
    const uint32_t address = 0x40000000U + (uint32_t)offset;
    return read_at(user, peripheral_at(user, address, "read"), address, size);
}

void bus_write(uc_engine *uc, uint64_t offset, unsigned size, uint64_t value, void *user)
{
    (void)uc;
    const uint32_t address = 0x40000000U + (uint32_t)offset;
    write_at(user, peripheral_at(user, address, "write"), address, size, (uint32_t)value);
}

/* The registers of LMEM have addresses among the core's own. */
static int private_peripheral(const emu_t *emu, uint32_t address)
{
    for (int p = peripherals_count - 1; p >= 0; p--) {
        if (emu->facts_of[p]->base / PAGE == address / PAGE) {
            return p;
        }
    }
    return -1;
}

bool bus_private_read(emu_t *emu, uint32_t address, unsigned size, uint64_t *value)
{
    const int p = private_peripheral(emu, address);
    *value = read_at(emu, p, address, size);
    return p >= 0;
}

bool bus_private_write(emu_t *emu, uint32_t address, unsigned size, uint32_t value)
{
    const int p = private_peripheral(emu, address);
    write_at(emu, p, address, size, value);
    return p >= 0;
}
