/* SPDX-License-Identifier: Apache-2.0 */
/* Access of tests and tools to a running emulator. */
#include <stdlib.h>
#include <string.h>

#include "emu_private.h"

#define PERIPHERAL_BUS 0x40000000U
#define PRIVATE_BUS 0xE0000000U
enum { PDOR = 0x00, PDDR = 0x14 };

enum { RAM_PIECE = 1024 }; /* divides RAM_SIZE */

emu_pins_t *emu_pins(emu_t *emu)
{
    ftm_shaft(emu);
    emu->s.pins_set_at = emu->s.ftm[0].triggers_due ? emu->s.ftm[0].start : emu->s.now; /* start of the period */
    return &emu->s.pins;
}

const emu_pins_t *emu_pins_now(const emu_t *emu)
{
    return &emu->s.pins;
}

void emu_encoder_fault(emu_t *emu, emu_encoder_fault_t fault)
{
    emu->s.as5047.fault = fault;
}

void emu_board_pins(emu_t *emu, bool gate_fault, bool resolver_fault)
{
    emu->s.pins.gate_fault = gate_fault;
    emu->s.pins.resolver_fault = resolver_fault;
    ftm_fault_input(emu);
}

uint32_t emu_outputs(const emu_t *emu)
{
    emu_bridge_t bridge;
    emu_bridge(emu, &bridge);
    return bridge.driven;
}

void emu_core_state(emu_t *emu, emu_core_state_t state)
{
    emu->s.halted = state == EMU_HALTED;
    emu->s.stuck = state == EMU_STUCK;
    ftm_debug(emu, emu->s.halted);
}

uint32_t emu_counter_read(const emu_t *emu, int timer, bool before)
{
    return emu->s.ftm[timer].read[before ? 1 : 0];
}

uint32_t emu_resolver_angle(const emu_t *emu)
{
    return emu->s.rdc.latched;
}

emu_line_t emu_line(const emu_t *emu, unsigned line)
{
    const bool connected = (bus_get(emu, PERIPHERAL(PORTC), 4U * line) >> 8 & 7U) == 1U;
    const peripheral_t *port = PERIPHERAL(PTC);
    if (!connected || (bus_get(emu, port, PDDR) >> line & 1U) == 0U) {
        return EMU_LINE_RELEASED;
    }
    return (bus_get(emu, port, PDOR) >> line & 1U) != 0U ? EMU_LINE_HIGH : EMU_LINE_LOW;
}

/* The board pulls it down. */
bool emu_gate_driver(const emu_t *emu)
{
    return emu_line(emu, EMU_GATE_DRIVER) == EMU_LINE_HIGH;
}

/* The board pulls it up: a processor in reset requests the safe state. */
bool emu_safe_state_requested(const emu_t *emu)
{
    return emu_line(emu, EMU_SAFE_STATE) != EMU_LINE_LOW;
}

/* The shaft keeps turning between two settings of the pins. */
uint32_t emu_angle(const emu_t *emu)
{
    return emu_angle_at(emu, emu_instant(emu));
}

uint32_t emu_angle_at(const emu_t *emu, uint64_t when)
{
    const int64_t passed = (int64_t)(when - emu->s.pins_set_at);
    return emu->s.pins.angle + (uint32_t)((passed * emu->s.pins.angle_rate) / 65536);
}

const char *emu_error(const emu_t *emu)
{
    return emu->error[0] != '\0' ? emu->error : NULL;
}

uint64_t emu_now(const emu_t *emu)
{
    return emu->s.now;
}

uint64_t emu_instructions(const emu_t *emu)
{
    return emu->s.instructions;
}

uint32_t emu_resets(const emu_t *emu)
{
    return emu->s.resets;
}

bool emu_read(const emu_t *emu, uint32_t address, void *to, uint32_t size)
{
    const uint8_t *cells = data_flash_at((emu_t *)(uintptr_t)emu, address, size);
    if (cells != NULL) {
        memcpy(to, cells, size);
        return true;
    }
    return uc_mem_read(emu->uc, address, to, size) == UC_ERR_OK;
}

bool emu_write(emu_t *emu, uint32_t address, const void *from, uint32_t size)
{
    uint8_t *cells = data_flash_at(emu, address, size);
    if (cells != NULL) {
        memcpy(cells, from, size);
        return true;
    }
    return emu_memory_write(emu, address, from, size);
}

uint32_t emu_symbol(const emu_t *emu, const char *name)
{
    return elf_symbol(&emu->elf, name, NULL);
}

uint32_t emu_symbol_size(const emu_t *emu, const char *name)
{
    uint32_t size = 0;
    (void)elf_symbol(&emu->elf, name, &size);
    return size;
}

/* Finds a register by its name, for example "FTM0.MOD"; false: there is none. */
static bool find_named(const emu_t *emu, const char *name, int *peripheral, int *number)
{
    const char *dot = strchr(name, '.');
    for (int p = 0; dot != NULL && p < peripherals_count; p++) {
        const size_t length = strlen(peripherals[p].name);
        if ((size_t)(dot - name) != length || strncmp(name, peripherals[p].name, length) != 0) {
            continue;
        }
        for (int r = 0; r < emu->facts_of[p]->count; r++) {
            if (strcmp(emu->facts_of[p]->fact[r].name, dot + 1) == 0) {
                *peripheral = p;
                *number = r;
                return true;
            }
        }
    }
    return false;
}

uint64_t emu_register(const emu_t *emu, const char *name)
{
    int p, r;
    return find_named(emu, name, &p, &r) ? emu->s.value[p][r] : UINT64_MAX;
}

bool emu_register_set(emu_t *emu, const char *name, uint32_t value)
{
    int p, r;
    if (!find_named(emu, name, &p, &r)) {
        return false;
    }
    emu->s.value[p][r] = value;
    return true;
}

/* The registers of the cache (LMEM) have addresses among the core's own; all others are on the peripheral bus. */
uint64_t emu_register_load(emu_t *emu, const char *name)
{
    int p, r;
    uint64_t value = UINT64_MAX;
    if (find_named(emu, name, &p, &r)) {
        const fact_t *fact = &emu->facts_of[p]->fact[r];
        const uint32_t address = emu->facts_of[p]->base + fact->offset;
        if (address < PRIVATE_BUS) {
            return bus_read(emu->uc, address - PERIPHERAL_BUS, fact->bytes, emu);
        }
        (void)bus_private_read(emu, address, fact->bytes, &value);
    }
    return value;
}

bool emu_register_store(emu_t *emu, const char *name, uint32_t value)
{
    int p, r;
    if (!find_named(emu, name, &p, &r)) {
        return false;
    }
    const fact_t *fact = &emu->facts_of[p]->fact[r];
    const uint32_t address = emu->facts_of[p]->base + fact->offset;
    if (address >= PRIVATE_BUS) {
        return bus_private_write(emu, address, fact->bytes, value);
    }
    bus_write(emu->uc, address - PERIPHERAL_BUS, fact->bytes, value, emu);
    return true;
}

void emu_on_exception(emu_t *emu, emu_exception_fn fn, void *user)
{
    emu->on_exception = fn;
    emu->on_exception_user = user;
}

int emu_active_vector(const emu_t *emu)
{
    return emu->s.nvic.nest > 0 ? emu->s.nvic.active[emu->s.nvic.nest - 1] : 0;
}

void emu_can_port(emu_t *emu, can_port_t *port)
{
    emu->can_port = port;
}

void emu_pend(emu_t *emu, int vector)
{
    nvic_pend(emu, vector);
}

emu_counts_t emu_counts(const emu_t *emu, int vector)
{
    return vector >= 0 && vector < VECTORS ? emu->counts[vector] : (emu_counts_t){0};
}

void emu_counts_clear(emu_t *emu)
{
    memset(emu->counts, 0, sizeof emu->counts);
}

void emu_break_after(emu_t *emu, uint64_t instructions)
{
    emu->s.break_at = emu->s.instructions + instructions;
}

emu_snapshot_t *emu_save(emu_t *emu)
{
    emu_snapshot_t *snapshot = calloc(1, sizeof *snapshot);
    if (snapshot != NULL && uc_context_alloc(emu->uc, &snapshot->context) == UC_ERR_OK) {
        (void)uc_context_save(emu->uc, snapshot->context);
        snapshot->state = emu->s;
        snapshot->flash = emu->flash;
        (void)uc_mem_read(emu->uc, RAM_BASE, snapshot->ram, RAM_SIZE);
    }
    return snapshot;
}

/* Only what differs is written: unicorn translates code anew after every write to it. */
static void ram_restore(emu_t *emu, const uint8_t *ram)
{
    uint8_t now[RAM_PIECE];
    for (uint32_t at = 0; at < RAM_SIZE; at += RAM_PIECE) {
        (void)uc_mem_read(emu->uc, RAM_BASE + at, now, RAM_PIECE);
        if (memcmp(now, ram + at, RAM_PIECE) != 0) {
            (void)emu_memory_write(emu, RAM_BASE + at, ram + at, RAM_PIECE);
        }
    }
}

void emu_restore(emu_t *emu, const emu_snapshot_t *snapshot)
{
    (void)uc_context_restore(emu->uc, snapshot->context);
    ram_restore(emu, snapshot->ram);
    emu->s = snapshot->state;
    emu->flash = snapshot->flash;
    emu->error[0] = '\0';
    emu_upper_ram_update(emu);
}

void emu_snapshot_free(emu_snapshot_t *snapshot)
{
    if (snapshot != NULL) {
        (void)uc_context_free(snapshot->context);
        free(snapshot);
    }
}
