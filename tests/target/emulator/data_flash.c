/* SPDX-License-Identifier: Apache-2.0 */
#include "data_flash.h"

#include <string.h>

enum { CACHE_LINE = 16, ENCACHE = 1, SPECULATION_OFF = 0x30, OCMDR1 = 0x404, BFHFNMIGN = 1 << 8 };
#define MICROSECONDS (EMU_TICKS_PER_S / 1000000U)
#define PROGRAM_US 90U /* data sheet: t_pgm8, 225 us at most */
#define PROGRAM_SLOW_US 225U
#define ERASE_US 12000U /* data sheet: t_ersscr, 130 ms at most */
#define ERASE_SLOW_US 130000U

/* xorshift32: the same cuts make the same cells. */
static uint32_t draw(emu_t *emu)
{
    uint32_t x = emu->flash.random;
    x ^= x << 13;
    x ^= x >> 17;
    x ^= x << 5;
    emu->flash.random = x;
    return x;
}

static double share(emu_t *emu)
{
    return (double)draw(emu) / 4294967296.0;
}

uint64_t data_flash_duration(const emu_t *emu, bool erase)
{
    const uint32_t us = emu->flash.slow ? (erase ? ERASE_SLOW_US : PROGRAM_SLOW_US) : (erase ? ERASE_US : PROGRAM_US);
    return us * MICROSECONDS;
}

/* What a cache holds of these cells is old from now on. */
static void changed(emu_t *emu, uint32_t address, uint32_t size)
{
    for (uint32_t line = address / CACHE_LINE; line <= (address + size - 1U) / CACHE_LINE; line++) {
        emu->flash.stale[line] = emu->flash.held[line] || emu->flash.speculated[line];
    }
}

bool data_flash_erase(emu_t *emu, uint32_t address)
{
    data_flash_t *f = &emu->flash;
    const uint32_t first = address / DATA_FLASH_SECTOR * DATA_FLASH_SECTOR;
    const uint32_t sector = first / DATA_FLASH_SECTOR;
    changed(emu, first, DATA_FLASH_SECTOR);
    f->erases[sector]++;
    if (f->worn[sector]) {
        return false;
    }
    memset(&f->cell[first], 0xFF, DATA_FLASH_SECTOR);
    memset(&f->uncertain[first / DATA_FLASH_PHRASE], 0, DATA_FLASH_SECTOR / DATA_FLASH_PHRASE);
    return true;
}

/* Programming clears bits only. The check bits of the phrase are programmed with it: a second time they match neither
 * content. */
bool data_flash_program(emu_t *emu, uint32_t address, const uint8_t data[DATA_FLASH_PHRASE])
{
    data_flash_t *f = &emu->flash;
    uint8_t *cell = &f->cell[address];
    static const uint8_t erased[DATA_FLASH_PHRASE] = {0xFF, 0xFF, 0xFF, 0xFF, 0xFF, 0xFF, 0xFF, 0xFF};
    const bool was_erased = memcmp(cell, erased, sizeof erased) == 0;
    changed(emu, address, DATA_FLASH_PHRASE);
    for (uint32_t k = 0; k < DATA_FLASH_PHRASE; k++) {
        cell[k] &= (uint8_t)(data[k] | (f->weak[address / DATA_FLASH_SECTOR] ? 0x10U : 0U));
    }
    if (!was_erased) {
        f->uncertain[address / DATA_FLASH_PHRASE] = true;
    }
    return was_erased && memcmp(cell, data, DATA_FLASH_PHRASE) == 0;
}

void data_flash_erase_cut(emu_t *emu, uint32_t address, double done)
{
    data_flash_t *f = &emu->flash;
    const uint32_t first = address / DATA_FLASH_SECTOR * DATA_FLASH_SECTOR;
    f->erases[first / DATA_FLASH_SECTOR]++;
    for (uint32_t at = first; at < first + DATA_FLASH_SECTOR; at += DATA_FLASH_PHRASE) {
        const bool erased = share(emu) < done;
        for (uint32_t k = 0; k < DATA_FLASH_PHRASE; k++) {
            const uint32_t some = draw(emu);
            f->cell[at + k] |= (uint8_t)(erased ? 0xFFU : some & some >> 8);
        }
        f->uncertain[at / DATA_FLASH_PHRASE] = f->uncertain[at / DATA_FLASH_PHRASE] || share(emu) < 0.5;
    }
}

void data_flash_program_cut(emu_t *emu, uint32_t address, const uint8_t data[DATA_FLASH_PHRASE], double done)
{
    data_flash_t *f = &emu->flash;
    for (uint32_t k = 0; k < DATA_FLASH_PHRASE; k++) {
        const uint32_t not_yet = share(emu) < done ? 0U : draw(emu);
        f->cell[address + k] &= (uint8_t)(data[k] | not_yet);
    }
    f->uncertain[address / DATA_FLASH_PHRASE] = true;
}

/* ---- reading ---- */

static bool is_cached(const emu_t *emu)
{
    const peripheral_t *cache = PERIPHERAL(LMEM);
    const uint32_t control = bus_get(emu, cache, 0), regions = bus_get(emu, cache, DATA_FLASH_PCCRMR);
    return (control & ENCACHE) != 0U && (regions >> 26 & 3U) != 0U;
}

static bool is_speculated(const emu_t *emu)
{
    return (bus_get(emu, PERIPHERAL(MSCM), OCMDR1) & SPECULATION_OFF) != SPECULATION_OFF;
}

static void check_caches(emu_t *emu, uint32_t offset)
{
    const uint32_t line = offset / CACHE_LINE;
    if (emu->flash.stale[line]) {
        emu_fail(emu, "read of the data flash at 0x%08x: a cache or the speculation buffer may hold what was there",
                 DATA_FLASH_BASE + offset);
    }
    emu->flash.held[line] = emu->flash.held[line] || is_cached(emu);
    emu->flash.speculated[line] = emu->flash.speculated[line] || is_speculated(emu);
}

/* The core ignores a data bus fault at the priority of FAULTMASK with CCR.BFHFNMIGN (Armv7-M, B3.2.8). */
static bool ignores_bus_faults(const emu_t *emu)
{
    uint32_t faultmask = 0;
    (void)uc_reg_read(emu->uc, UC_ARM_REG_FAULTMASK, &faultmask);
    return (faultmask & 1U) != 0U && (emu->s.nvic.ccr & BFHFNMIGN) != 0U;
}

static bool fails(emu_t *emu, uint32_t offset)
{
    return emu->flash.uncertain[offset / DATA_FLASH_PHRASE] && (draw(emu) & 0x10000U) != 0U;
}

uint64_t data_flash_read(uc_engine *uc, uint64_t offset, unsigned size, void *user)
{
    (void)uc;
    emu_t *emu = user;
    const uint32_t at = (uint32_t)offset;
    uint64_t value = 0;
    if (ftfc_is_busy(emu)) {
        emu_fail(emu, "read of the data flash at 0x%08x: a command runs on it", DATA_FLASH_BASE + at);
    }
    check_caches(emu, at);
    memcpy(&value, &emu->flash.cell[at], size);
    if (fails(emu, at)) {
        ftfc_double_bit_fault(emu);
        value ^= draw(emu);
        if (!ignores_bus_faults(emu)) {
            emu_fail(emu, "read of the data flash at 0x%08x: uncorrectable error, a bus fault", DATA_FLASH_BASE + at);
        }
    }
    return value;
}

void data_flash_write(uc_engine *uc, uint64_t offset, unsigned size, uint64_t value, void *user)
{
    (void)uc, (void)size, (void)value;
    emu_fail(user, "write of the data flash at 0x%08x: only commands of the FTFC change it",
             DATA_FLASH_BASE + (uint32_t)offset);
}

/* ---- from outside ---- */

void data_flash_create(emu_t *emu)
{
    memset(&emu->flash, 0, sizeof emu->flash);
    memset(emu->flash.cell, 0xFF, sizeof emu->flash.cell);
    emu->flash.random = 1;
}

/* As delivered by a bus master that holds no copies: a debugger. */
uint8_t *data_flash_at(emu_t *emu, uint32_t address, uint32_t size)
{
    const uint32_t offset = address - DATA_FLASH_BASE;
    return offset < DATA_FLASH_SIZE && size <= DATA_FLASH_SIZE - offset ? &emu->flash.cell[offset] : NULL;
}

/* The code cache is invalidated; nothing invalidates the speculation buffer. */
void data_flash_uncached(emu_t *emu)
{
    data_flash_t *f = &emu->flash;
    for (uint32_t line = 0; line < DATA_FLASH_SIZE / CACHE_LINE; line++) {
        f->held[line] = false;
        f->stale[line] = f->stale[line] && f->speculated[line];
    }
}

void data_flash_reset(emu_t *emu)
{
    memset(emu->flash.speculated, 0, sizeof emu->flash.speculated);
    data_flash_uncached(emu);
}

void emu_flash_slow(emu_t *emu, bool slow)
{
    emu->flash.slow = slow;
}

void emu_flash_worn(emu_t *emu, uint32_t sector, bool worn)
{
    emu->flash.worn[sector % DATA_FLASH_SECTORS] = worn;
}

void emu_flash_weak(emu_t *emu, uint32_t sector, bool weak)
{
    emu->flash.weak[sector % DATA_FLASH_SECTORS] = weak;
}

void emu_flash_random(emu_t *emu, uint32_t seed)
{
    emu->flash.random = seed != 0U ? seed : 1U;
}

uint32_t emu_flash_erases(const emu_t *emu, uint32_t sector)
{
    return emu->flash.erases[sector % DATA_FLASH_SECTORS];
}

void emu_flash_spoil(emu_t *emu, uint32_t address)
{
    const uint32_t offset = address - DATA_FLASH_BASE;
    emu->flash.uncertain[offset % DATA_FLASH_SIZE / DATA_FLASH_PHRASE] = true;
}
