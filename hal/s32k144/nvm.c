/* SPDX-License-Identifier: Apache-2.0 */
#include "hal/s32k144/nvm.h"

#include "fx/codegen.h"
#include "hal/nvm.h"
#include "hal/s32k144/clock.h"
#include "hal/s32k144/core.h"
#include "hal/s32k144/pwm.h"
#include "hal/s32k144/registers.h"
#include "hal/s32k144/startup.h"
#include "hal/s32k144/tick.h"

#define SECTOR 2048U
#define COMMAND_BASE 0x800000U /* of the data flash in the address of a command */
#define PROGRAM_PHRASE 0x07U
#define ERASE_SECTOR 0x09U
#define ERRORS (FTFC_FSTAT_RDCOLERR | FTFC_FSTAT_ACCERR | FTFC_FSTAT_FPVIOL)
#define FAILED (ERRORS | FTFC_FSTAT_MGSTAT0)
#define COMMAND_LOOPS 4000000U /* more than the 130 ms that the data sheet allows an erase */
#define SPECULATION_OFF 3U

_Static_assert(HAL_NVM_SLOTS *HAL_NVM_SLOT_SIZE == 65536U && HAL_NVM_SECTOR_SLOTS * HAL_NVM_SLOT_SIZE == SECTOR,
               "all of the FlexNVM, in its sectors");

extern const volatile uint8_t nvm_start[]; /* from the linker script */

/* In SRAM with everything it calls: until the controller has accepted or refused the command, nothing is fetched from
 * the flash by this priority. Bounded; a command that never ends fails. */
__attribute__((section(".hot"), noinline, long_call)) static uint32_t run_command(void)
{
    FTFC->FSTAT = FTFC_FSTAT_CCIF;
    for (uint32_t k = 0; k < COMMAND_LOOPS; k++) {
        const uint32_t status = FTFC->FSTAT;
        if ((status & FTFC_FSTAT_CCIF) != 0U) {
            return status;
        }
    }
    return FAILED;
}

/* The code cache may hold what a command has changed, although the data flash's region is not cached: it costs little
 * to exclude that. */
static void discard_cached(void)
{
    LMEM->LMEM_PCCCR = LMEM_PCCCR_INVW0 | LMEM_PCCCR_INVW1 | LMEM_PCCCR_GO | LMEM_PCCCR_ENCACHE;
    await(&LMEM->LMEM_PCCCR, LMEM_PCCCR_GO, 0);
}

/* Not inlined: the only place that calls through an address (budget.toml). */
static FX_NOT_INLINED bool flash_command(uint32_t code, uint32_t slot, uint32_t offset)
{
    const uint32_t address = COMMAND_BASE + slot * HAL_NVM_SLOT_SIZE + offset;
    FTFC->FCCOB0 = (uint8_t)code;
    FTFC->FCCOB1 = (uint8_t)(address >> 16);
    FTFC->FCCOB2 = (uint8_t)(address >> 8);
    FTFC->FCCOB3 = (uint8_t)address;
    return (run_command() & FAILED) == 0U;
}

/* Clears the errors of the last command: with one of them set none starts. False: one still runs. */
static bool is_ready(void)
{
    FTFC->FSTAT = ERRORS;
    return (FTFC->FSTAT & FTFC_FSTAT_CCIF) != 0U;
}

static bool is_within(uint32_t slot, uint32_t offset, uint32_t size)
{
    return slot < HAL_NVM_SLOTS && offset <= HAL_NVM_SLOT_SIZE && size <= HAL_NVM_SLOT_SIZE - offset;
}

void nvm_init(void)
{
    MSCM->OCMDR1 = MSCM->OCMDR1 | MSCM_OCMDR1_OCM1(SPECULATION_OFF);
    LMEM->PCCRMR = LMEM->PCCRMR & ~LMEM_PCCRMR_R2_MASK;
}

bool hal_nvm_begin(void)
{
    if (!is_ready()) {
        return false;
    }
    clock_slow();
    return true;
}

/* The PWM timer has counted half as fast, so that the task's timer no longer expires where it should. */
void hal_nvm_end(void)
{
    clock_fast();
    __asm__ volatile("cpsid i" ::: "memory");
    tick_align(pwm_elapsed() / (CLOCK_CORE_HZ / CLOCK_PERIPHERAL_HZ));
    __asm__ volatile("cpsie i" ::: "memory");
}

/* A phrase that a power cut left half programmed may be uncorrectable: reading it is a bus fault, which the core
 * ignores in between; the controller's flag reports it. */
static void read_phrase(const volatile uint8_t *from, uint8_t *to, uint32_t size)
{
    core_ignore_bus_faults(true);
    for (uint32_t k = 0; k < size; k++) {
        to[k] = from[k];
    }
    core_ignore_bus_faults(false);
}

bool hal_nvm_read(uint32_t slot, uint32_t offset, void *data, uint32_t size)
{
    if (!is_within(slot, offset, size) || !is_ready()) {
        return false;
    }
    const volatile uint8_t *from = nvm_start + slot * HAL_NVM_SLOT_SIZE + offset;
    uint8_t *to = data;
    FTFC->FERSTAT = FTFC_FERSTAT_DFDIF;
    for (uint32_t done = 0; done < size; done += HAL_NVM_UNIT) {
        const uint32_t left = size - done;
        read_phrase(from + done, to + done, (left < HAL_NVM_UNIT) ? left : HAL_NVM_UNIT);
    }
    return (FTFC->FERSTAT & FTFC_FERSTAT_DFDIF) == 0U;
}

bool hal_nvm_erase(uint32_t slot)
{
    if (slot >= HAL_NVM_SLOTS || slot % HAL_NVM_SECTOR_SLOTS != 0U || !is_ready()) {
        return false;
    }
    const bool erased = flash_command(ERASE_SECTOR, slot, 0);
    discard_cached();
    return erased;
}

/* The first byte of a phrase lies at the lowest address of the parameters. */
static bool program_phrase(uint32_t slot, uint32_t offset, const uint8_t phrase[HAL_NVM_UNIT])
{
    volatile uint8_t *parameter = &FTFC->FCCOB7;
    if (!is_ready()) {
        return false;
    }
    for (uint32_t k = 0; k < HAL_NVM_UNIT; k++) {
        parameter[k] = phrase[k];
    }
    return flash_command(PROGRAM_PHRASE, slot, offset);
}

bool hal_nvm_program(uint32_t slot, uint32_t offset, const void *data, uint32_t size)
{
    if (!is_within(slot, offset, size) || offset % HAL_NVM_UNIT != 0U || size % HAL_NVM_UNIT != 0U) {
        return false;
    }
    bool programmed = true;
    for (uint32_t done = 0; done < size && programmed; done += HAL_NVM_UNIT) {
        programmed = program_phrase(slot, offset + done, (const uint8_t *)data + done);
    }
    discard_cached();
    return programmed;
}
