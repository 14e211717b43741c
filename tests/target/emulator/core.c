/* SPDX-License-Identifier: Apache-2.0 */
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "emu_private.h"

enum {
    FIRC_TICKS = 70, /* 48 MHz: the core's clock after reset */
    MMIO_BASE = 0x40000000,
    MMIO_SIZE = 0x100000,
    PPB_SIZE = 0x100000,
    NO_ADDRESS = 0xFFFFFFF0U - 0x20000000U,
    BRANCH_TO_ITSELF = 0xE7FE,
};
#define PPB_BASE 0xE0000000U

void emu_fail(emu_t *emu, const char *format, ...)
{
    if (emu->error[0] == '\0') {
        char text[ERROR_SIZE / 2];
        va_list arguments;
        va_start(arguments, format);
        (void)vsnprintf(text, sizeof text, format, arguments);
        va_end(arguments);
        const uint32_t pc = emu_pc(emu);
        uint32_t offset;
        const char *function = elf_function(&emu->elf, pc, &offset);
        (void)snprintf(emu->error, sizeof emu->error, "%s, pc 0x%08x (%s+0x%x), %.6f s", text, pc, function, offset,
                       (double)emu->s.now / (double)EMU_TICKS_PER_S);
    }
    emu->s.stop = true;
    (void)uc_emu_stop(emu->uc);
}

uint32_t emu_pc(const emu_t *emu)
{
    uint32_t pc = 0;
    (void)uc_reg_read(emu->uc, UC_ARM_REG_PC, &pc);
    return pc;
}

/* ---- time ---- */

static void limit_update(emu_t *emu, uint64_t end)
{
    uint64_t next = end;
    for (int i = 0; i < TIMERS; i++) {
        next = emu->s.due[i] < next ? emu->s.due[i] : next;
    }
    emu->s.limit = next;
}

void emu_timer(emu_t *emu, timer_t_ timer, uint64_t due)
{
    emu->s.due[timer] = due;
    if (due < emu->s.limit) {
        emu->s.limit = due;
    }
}

static uint64_t stretched(uint64_t instant, uint64_t now, uint32_t before, uint32_t after)
{
    const uint64_t distance = (instant > now ? instant - now : now - instant) * after / before;
    return instant > now ? now + distance : now - distance;
}

static void stretch(uint64_t *instant, uint64_t now, uint32_t before, uint32_t after)
{
    if (*instant != NEVER && *instant != 0U) {
        *instant = stretched(*instant, now, before, after);
    }
}

/* What counts the core's clock keeps its count. */
void emu_core_clock(emu_t *emu, uint32_t ticks_per_cycle)
{
    static const timer_t_ counted[] = {TIMER_FTM0,  TIMER_FTM2,    TIMER_PDB0, TIMER_PDB1,
                                       TIMER_FAULT, TIMER_SYSTICK, TIMER_DMA};
    state_t *s = &emu->s;
    const uint32_t before = s->core_ticks;
    s->core_ticks = ticks_per_cycle;
    if (before == 0U || before == ticks_per_cycle) {
        return;
    }
    for (size_t i = 0; i < sizeof counted / sizeof counted[0]; i++) {
        stretch(&s->due[counted[i]], s->now, before, ticks_per_cycle);
    }
    for (int i = 0; i < 2; i++) {
        stretch(&s->ftm[i].start, s->now, before, ticks_per_cycle);
        stretch(&s->pdb[i].start, s->now, before, ticks_per_cycle);
        for (size_t k = 0; k < sizeof s->pdb[i].due / sizeof s->pdb[i].due[0]; k++) {
            stretch(&s->pdb[i].due[k], s->now, before, ticks_per_cycle);
        }
    }
    s->stop = true; /* the next event is due at another time */
}

uint64_t emu_instant(const emu_t *emu)
{
    return emu->s.event != NEVER ? emu->s.event : emu->s.now;
}

static int timer_next(const emu_t *emu)
{
    int next = 0;
    for (int i = 1; i < TIMERS; i++) {
        next = emu->s.due[i] < emu->s.due[next] ? i : next;
    }
    return next;
}

static void timer_fire(emu_t *emu)
{
    static void (*const fire[TIMERS])(emu_t *, int) = {
        [TIMER_FTM0] = ftm_fire,   [TIMER_FTM2] = ftm_fire,   [TIMER_PDB0] = pdb_fire,   [TIMER_PDB1] = pdb_fire,
        [TIMER_ADC0] = adc_fire,   [TIMER_ADC1] = adc_fire,   [TIMER_LPIT0] = lpit_fire, [TIMER_LPIT1] = lpit_fire,
        [TIMER_LPIT2] = lpit_fire, [TIMER_LPIT3] = lpit_fire,
    };
    static const uint8_t instance[TIMERS] = {[TIMER_FTM2] = 1,  [TIMER_PDB1] = 1,  [TIMER_ADC1] = 1,
                                             [TIMER_LPIT1] = 1, [TIMER_LPIT2] = 2, [TIMER_LPIT3] = 3};
    const int i = timer_next(emu);
    emu->s.event = emu->s.due[i];
    emu->s.due[i] = NEVER;
    if (fire[i] != NULL) {
        fire[i](emu, instance[i]);
    } else if (i == TIMER_FAULT) {
        ftm_fault_fire(emu);
    } else if (i == TIMER_WDOG) {
        wdog_fire(emu);
    } else if (i == TIMER_CAN) {
        can_fire(emu);
    } else if (i == TIMER_FTFC) {
        ftfc_fire(emu);
    } else if (i == TIMER_DMA) {
        dma_fire(emu);
    } else {
        systick_fire(emu);
    }
    emu->s.event = NEVER;
}

/* Fires the timers in the order in which they are due. At the start of a period the rest waits until emu_run() has
 * returned and its caller has set the pins. */
static void timers_fire(emu_t *emu)
{
    while (!emu->s.centre && emu->s.due[timer_next(emu)] <= emu->s.now) {
        timer_fire(emu);
    }
}

/* ---- instructions ---- */

static uint16_t count_instructions(const uint8_t *code, uint32_t size)
{
    uint16_t count = 0;
    for (uint32_t at = 0; at < size; count++) {
        at += code[at + 1] >= THUMB_32BIT ? 4U : 2U;
    }
    return count;
}

/* Number of instructions that an IT instruction makes conditional: the lowest set bit ends its mask. */
static uint8_t conditional(const uint8_t it[2])
{
    uint8_t slots = 0;
    for (uint32_t mask = it[1] == 0xBF ? it[0] & 0xFU : 0U; mask != 0; mask = mask << 1 & 0xFU) {
        slots++;
    }
    return slots;
}

static __attribute__((noinline)) block_t block_read(emu_t *emu, uint32_t address, uint32_t size)
{
    uint8_t code[4096];
    block_t block = {.size = (uint16_t)size, .count = 1};
    if (size <= sizeof code && uc_mem_read(emu->uc, address, code, size) == UC_ERR_OK) {
        block.count = count_instructions(code, size);
        block.conditional = size == 2U ? conditional(code) : (uint8_t)0;
        block.idle = size == 2U && (code[0] | code[1] << 8) == BRANCH_TO_ITSELF;
    }
    return block;
}

/* In line but for reading the code: this is called before each block that runs. */
static inline block_t block_at(emu_t *emu, uint32_t address, uint32_t size)
{
    const uint32_t place = code_place(address);
    if (place >= CODE_SIZE / 2) {
        return block_read(emu, address, size);
    }
    block_t *known = &emu->block[place];
    if (known->size != size) {
        *known = block_read(emu, address, size);
    }
    return *known;
}

/* Unicorn discards pages that follow each other in one of its memories; the RAM is two of them. */
static bool translated_discard(emu_t *emu, uint32_t address, uint32_t size)
{
    const uint32_t end = address + size;
    const uint32_t first_end = address < RAM_UPPER && end > RAM_UPPER ? RAM_UPPER : end;
    // NOLINTBEGIN(clang-analyzer-optin.core.EnumCastOutOfRange): Unicorn's flags are made to be combined
    return uc_ctl_remove_cache(emu->uc, address, first_end) == UC_ERR_OK &&
           (first_end == end || uc_ctl_remove_cache(emu->uc, first_end, end) == UC_ERR_OK);
    // NOLINTEND(clang-analyzer-optin.core.EnumCastOutOfRange)
}

bool emu_memory_write(emu_t *emu, uint32_t address, const void *from, uint32_t size)
{
    if (uc_mem_write(emu->uc, address, from, size) != UC_ERR_OK) {
        return false;
    }
    for (uint32_t at = address & ~1U; at < address + size; at += 2U) {
        if (code_place(at) < CODE_SIZE / 2) {
            emu->block[code_place(at)].size = 0;
        }
    }
    if (!translated_discard(emu, address, size)) {
        emu_fail(emu, "translated code at 0x%08x cannot be discarded", address);
    }
    return true;
}

static bool must_stop(const state_t *s)
{
    return s->stop || s->now >= s->limit || s->reschedule || s->instructions >= s->break_at;
}

static bool is_exception_unmasked(emu_t *emu)
{
    if (emu->s.poll_masks && nvic_best(emu) >= 0) {
        emu->s.reschedule = true;
    }
    return emu->s.reschedule;
}

/* Called before a block (in counting mode: before an instruction) runs; a stop from here takes effect before it. Timers
 * and interrupts stop the core only here, because a stop from within an access would repeat the instruction. */
static void on_code(uc_engine *uc, uint64_t address, uint32_t size, void *user)
{
    emu_t *emu = user;
    if (must_stop(&emu->s) || is_exception_unmasked(emu)) {
        (void)uc_emu_stop(uc);
        return;
    }
    const block_t block = block_at(emu, (uint32_t)address, size);
    if (block.idle) {
        emu->s.now = emu->s.limit; /* a branch to itself waits: the same as sleep */
        (void)uc_emu_stop(uc);
        return;
    }
    emu->s.instructions += block.count;
    if (emu->profile != NULL) {
        profile_instruction(emu, (uint32_t)address, size);
    }
    emu->s.now += (uint64_t)block.count * (emu->s.core_ticks * EMU_HALF_CYCLES_PER_INSTRUCTION / 2U);
}

/* on_data() and, for peripherals, on_refused() call this. Before it calls one, unicorn writes the state of the IT block
 * that contains the access to the processor's state, and never takes it back: what follows the block would be
 * conditional, too. */
static void it_state_clear(uc_engine *uc)
{
    enum { IT_BITS = 0x0600FC00 };
    uint32_t state = 0;
    (void)uc_reg_read(uc, UC_ARM_REG_CPSR, &state);
    if ((state & IT_BITS) != 0U) {
        state &= ~(uint32_t)IT_BITS;
        (void)uc_reg_write(uc, UC_ARM_REG_CPSR, &state);
    }
}

static void on_data(uc_engine *uc, uc_mem_type type, uint64_t address, int size, int64_t value, void *user)
{
    (void)value;
    it_state_clear(uc);
    emu_t *emu = user;
    if (emu->profile != NULL) {
        profile_access(emu, (uint32_t)address, (uint32_t)size, type == UC_MEM_WRITE);
    }
}

static bool is_peripheral(uint64_t address)
{
    return address - MMIO_BASE < MMIO_SIZE || address - PPB_BASE < PPB_SIZE ||
           address - DATA_FLASH_BASE < DATA_FLASH_SIZE;
}

/* Called for every access to the peripherals, because unicorn is told that none is permitted: it then updates the
 * program counter first, so that the message about a refused access can state it exactly. A hook of reads and writes
 * would do the same, but with any such hook every access to RAM and flash leaves the translated code, too. */
static bool on_refused(uc_engine *uc, uc_mem_type type, uint64_t address, int size, int64_t value, void *user)
{
    (void)value;
    emu_t *emu = user;
    const bool fetch = type == UC_MEM_FETCH_UNMAPPED || type == UC_MEM_FETCH_PROT;
    const bool write = type == UC_MEM_WRITE_UNMAPPED || type == UC_MEM_WRITE_PROT;
    if (!fetch && is_peripheral(address)) {
        it_state_clear(uc);
        return !(emu->takes_faults && bus_unclocked(emu, (uint32_t)address) && fault_data(emu, (uint32_t)address));
    }
    if (emu->s.upper_retained && address - RAM_UPPER < RAM_UPPER_SIZE) {
        /* The reference manual forbids every access to RAM whose content is retained. */
        emu_fail(emu, "access to 0x%08x: SIM.CHIPCTL.SRAMU_RETEN keeps this RAM from being accessed",
                 (uint32_t)address);
        return false;
    }
    if (fetch ? fault_fetch(emu, is_peripheral(address)) : fault_data(emu, (uint32_t)address)) {
        return false;
    }
    const char *what = fetch ? "fetch" : write ? "write" : "read";
    emu_fail(emu, "%s of %d bytes at 0x%08x: no memory, or not permitted", what, size, (uint32_t)address);
    return false;
}

void emu_upper_ram_update(emu_t *emu)
{
    if (emu->upper_closed != emu->s.upper_retained) {
        const uc_err code = uc_mem_protect(emu->uc, RAM_UPPER, RAM_UPPER_SIZE,
                                           emu->s.upper_retained ? UC_PROT_NONE : UC_PROT_ALL);
        if (code != UC_ERR_OK) {
            emu_fail(emu, "access to the upper RAM cannot be changed: %s", uc_strerror(code));
            return;
        }
        emu->upper_closed = emu->s.upper_retained;
    }
}

enum { PREFETCH_ABORT = 3, EXCEPTION_EXIT = 8 };

static void on_exception(uc_engine *uc, uint32_t number, void *user)
{
    emu_t *emu = user;
    if (number == EXCEPTION_EXIT) {
        emu->s.exc_return = emu_pc(emu) | 1U;
        (void)uc_emu_stop(uc);
    } else if (number == PREFETCH_ABORT && fault_fetch(emu, is_peripheral(emu_pc(emu)))) {
        (void)uc_emu_stop(uc);
    } else {
        emu_fail(emu, "the core raised exception %u (undefined instruction, SVC or breakpoint)", number);
    }
}

static bool asleep(emu_t *emu)
{
    uint8_t code[2] = {0, 0};
    const uint32_t pc = emu_pc(emu);
    (void)uc_mem_read(emu->uc, pc - 2U, code, 2);
    return code[0] == 0x30 && code[1] == 0xBF; /* wfi: unicorn stops after it and gives no reason */
}

static void run_core(emu_t *emu)
{
    state_t *s = &emu->s;
    s->exc_return = 0;
    const uc_err code = uc_emu_start(emu->uc, s->pc | 1U, NO_ADDRESS, 0, 0);
    s->pc = emu_pc(emu);
    if (fault_take(emu, code)) {
        return;
    }
    if (code != UC_ERR_OK) {
        emu_fail(emu, "the core stopped: %s", uc_strerror(code));
    } else if (s->exc_return != 0) {
        nvic_return(emu);
    } else if (!must_stop(s) && asleep(emu)) {
        s->nvic.sleeping = true;
    }
}

int emu_run(emu_t *emu, uint64_t ticks)
{
    state_t *s = &emu->s;
    const uint64_t end = s->now + ticks;
    ftm_triggers(emu);
    for (;;) {
        if (emu->error[0] != '\0') {
            return EMU_FAILED;
        }
        s->stop = false;
        timers_fire(emu);
        if (s->reset_wanted) {
            emu_reset(emu, s->reset_cause);
        }
        if (s->centre) {
            s->centre = false;
            return EMU_CENTRE;
        }
        if (s->now >= end) {
            return EMU_LIMIT;
        }
        limit_update(emu, end);
        s->reschedule = false;
        const bool executes = !s->halted && !s->stuck;
        if (executes && nvic_take(emu)) {
            s->nvic.sleeping = false;
        }
        if (s->instructions >= s->break_at) {
            s->break_at = NEVER;
            return EMU_BREAK;
        }
        if (s->nvic.sleeping || !executes) {
            s->now = s->now > s->limit ? s->now : s->limit;
        } else {
            run_core(emu);
        }
    }
}

/* RAM whose retention was not requested (SIM_CHIPCTL) has no known content after a reset. */
static void ram_lose(emu_t *emu, uint32_t from, uint32_t end)
{
    uint8_t lost[256];
    memset(lost, 0xA5, sizeof lost);
    for (uint32_t at = from; at < end; at += sizeof lost) {
        (void)emu_memory_write(emu, at, lost, sizeof lost);
    }
}

void emu_reset(emu_t *emu, uint32_t cause)
{
    state_t *s = &emu->s;
    const state_t old = *s;
    if (old.core_ticks != 0U) {
        ftfc_abort(emu);
    }
    if (cause != 0U) {
        ram_lose(emu, RAM_BASE, RAM_UPPER);
        ram_lose(emu, old.upper_retained ? RAM_BASE + RAM_SIZE : RAM_UPPER, RAM_BASE + RAM_SIZE);
    }
    memset(s, 0, sizeof *s);
    s->now = old.now;
    s->instructions = old.instructions;
    s->break_at = s->event = NEVER;
    s->resets = old.resets + (cause != 0 ? 1U : 0U);
    s->pins = old.pins;
    s->pins_set_at = old.pins_set_at;
    s->reset_cause = cause;
    for (int i = 0; i < TIMERS; i++) {
        s->due[i] = NEVER;
    }
    s->core_ticks = FIRC_TICKS;
    s->rdc = old.rdc; /* devices of their own */
    s->as5047 = old.as5047;
    s->analogue = old.analogue;
    s->windings.at = old.now;
    if (cause == 0U) {
        rdc_power_on(emu);
        as5047_power_on(emu);
    }
    pdb_reset(emu);
    bus_reset(emu);
    data_flash_reset(emu);
    ftfc_reset(emu);
    nvic_reset(emu);
    wdog_restart(emu);
    uint32_t vector[2] = {0, 0}, zero = 0, thumb = 1U << 24;
    (void)uc_mem_read(emu->uc, 0, vector, sizeof vector);
    (void)uc_reg_write(emu->uc, UC_ARM_REG_XPSR, &thumb); /* ends an IT block in which the program was stopped */
    (void)uc_reg_write(emu->uc, UC_ARM_REG_IPSR, &zero);
    (void)uc_reg_write(emu->uc, UC_ARM_REG_CONTROL, &zero);
    (void)uc_reg_write(emu->uc, UC_ARM_REG_PRIMASK, &zero);
    (void)uc_reg_write(emu->uc, UC_ARM_REG_BASEPRI, &zero);
    (void)uc_reg_write(emu->uc, UC_ARM_REG_SP, &vector[0]);
    s->pc = vector[1] & ~1U;
    emu_upper_ram_update(emu);
}

/* What the RAM holds after the supply has returned is not known. */
void emu_power_cycle(emu_t *emu)
{
    emu->error[0] = '\0';
    emu_reset(emu, 0);
    ram_lose(emu, RAM_BASE, RAM_BASE + RAM_SIZE);
}

void emu_reset_now(emu_t *emu, uint32_t cause)
{
    enum { POR = 0x80 };
    if ((cause & POR) != 0U) {
        emu_power_cycle(emu);
    } else {
        emu_reset(emu, cause);
    }
}

/* ---- creation ---- */

static bool peripherals_map(emu_t *emu, uint32_t base, uint32_t size, uc_cb_mmio_read_t read, uc_cb_mmio_write_t write)
{
    return uc_mmio_map(emu->uc, base, size, read, emu, write, emu) == UC_ERR_OK &&
           uc_mem_protect(emu->uc, base, size, UC_PROT_NONE) == UC_ERR_OK;
}

static bool maps_create(emu_t *emu)
{
    uc_hook hook;
    uc_engine *uc = emu->uc;
    const int kind = emu->mode == EMU_COUNTING ? UC_HOOK_CODE : UC_HOOK_BLOCK;
    return uc_mem_map(uc, 0, FLASH_SIZE, UC_PROT_READ | UC_PROT_EXEC) == UC_ERR_OK &&
           uc_mem_map(uc, RAM_BASE, RAM_UPPER - RAM_BASE, UC_PROT_ALL) == UC_ERR_OK &&
           uc_mem_map(uc, RAM_UPPER, RAM_UPPER_SIZE, UC_PROT_ALL) == UC_ERR_OK &&
           peripherals_map(emu, DATA_FLASH_BASE, DATA_FLASH_SIZE, data_flash_read, data_flash_write) &&
           peripherals_map(emu, MMIO_BASE, MMIO_SIZE, bus_read, bus_write) &&
           peripherals_map(emu, PPB_BASE, PPB_SIZE, scs_read, scs_write) &&
           uc_hook_add(uc, &hook, kind, (void *)on_code, emu, 1, 0) == UC_ERR_OK &&
           uc_hook_add(uc, &hook, UC_HOOK_INTR, (void *)on_exception, emu, 1, 0) == UC_ERR_OK &&
           uc_hook_add(uc, &hook, UC_HOOK_MEM_INVALID, (void *)on_refused, emu, 1, 0) == UC_ERR_OK;
}

/* What has been translated without the hook would not call it. If the flush fails, the next call repeats the flush and
 * does not add the hook a second time. */
bool emu_data_watch(emu_t *emu)
{
    uc_hook hook;
    // NOLINTBEGIN(clang-analyzer-optin.core.EnumCastOutOfRange): Unicorn's flags are made to be combined
    emu->data_watched = emu->data_watched || uc_hook_add(emu->uc, &hook, UC_HOOK_MEM_READ | UC_HOOK_MEM_WRITE,
                                                         (void *)on_data, emu, 1, 0) == UC_ERR_OK;
    return emu->data_watched && uc_ctl_flush_tb(emu->uc) == UC_ERR_OK;
    // NOLINTEND(clang-analyzer-optin.core.EnumCastOutOfRange)
}

static const char *program_load(emu_t *emu)
{
    elf_segment_t segment;
    for (int i = 0; elf_segment(&emu->elf, i, &segment); i++) {
        if (segment.address >= FLASH_SIZE || segment.file_size > FLASH_SIZE - segment.address) {
            return "has a part that does not lie in the flash";
        }
        if (!emu_memory_write(emu, segment.address, segment.content, segment.file_size)) {
            return "does not fit the flash";
        }
    }
    return NULL;
}

emu_t *emu_create(const char *elf, int mode, char *error, size_t size)
{
    emu_t *emu = calloc(1, sizeof *emu);
    const char *bad = emu == NULL ? "out of memory" : elf_read(&emu->elf, elf);
    if (bad == NULL) {
        emu->mode = (emu_mode_t)mode;
        emu->block = calloc(CODE_SIZE / 2, sizeof *emu->block);
        // NOLINTBEGIN(clang-analyzer-optin.core.EnumCastOutOfRange): Unicorn's flags are made to be combined
        if (emu->block == NULL || uc_open(UC_ARCH_ARM, UC_MODE_THUMB | UC_MODE_MCLASS, &emu->uc) != UC_ERR_OK ||
            uc_ctl_set_cpu_model(emu->uc, UC_CPU_ARM_CORTEX_M4) != UC_ERR_OK || !maps_create(emu) || !bus_create(emu)) {
            // NOLINTEND(clang-analyzer-optin.core.EnumCastOutOfRange)
            bad = "the emulated core cannot be created";
        } else {
            uint8_t erased[4096];
            memset(erased, 0xFF, sizeof erased);
            for (uint32_t at = 0; at < FLASH_SIZE; at += sizeof erased) {
                (void)emu_memory_write(emu, at, erased, sizeof erased);
            }
            bad = program_load(emu);
        }
    }
    if (bad != NULL) {
        (void)snprintf(error, size, "%s: %s", elf, bad);
        emu_destroy(emu);
        return NULL;
    }
    emu->as5047 = emu_symbol(emu, "angle_sensor_as5047") != 0U;
    emu->analogue = emu_symbol(emu, "angle_sensor_analogue") != 0U;
    emu->excited = emu_symbol(emu, "angle_sensor_analogue") == 2U;
    emu_adc_calibration(emu, ADC_CALIBRATION);
    analogue_power_on(emu);
    data_flash_create(emu);
    emu_reset(emu, 0);
    return emu;
}

void emu_destroy(emu_t *emu)
{
    if (emu != NULL) {
        if (emu->uc != NULL) {
            (void)uc_close(emu->uc);
        }
        bus_destroy(emu);
        elf_free(&emu->elf);
        free(emu->block);
        profile_stop(emu);
        free(emu);
    }
}
