/* SPDX-License-Identifier: Apache-2.0 */
/* Flash controller: commands on the FlexNVM used as data flash. The command, its parameters and its errors; the cells
 * themselves are in data_flash.c. Reference manual S32K1xx, chapters FTFC and flash memory; times: S32K1xx data sheet,
 * flash timing specifications (typical values; the largest ones with emu_flash_slow()).
 *
 * documented behaviour                             | modelled | test
 * -------------------------------------------------- | -------- | --------------------------------------------
 * Program Phrase: 8 bytes, address bit 23: D-flash | yes      | test_a_phrase_is_programmed_into_erased_cells
 * Erase Flash Sector: 2 KiB                        | yes      | test_a_sector_is_erased
 * CCIF 0 while a command runs, for its time        | yes      | test_a_command_takes_its_time
 * parameters cannot be written while a command runs | refused  | test_parameters_of_a_running_command_are_refused
 * unaligned or missing address, unknown code: ACCERR | yes      | test_a_wrong_command_is_an_access_error
 * ACCERR, FPVIOL: cleared by a one, block a launch | yes      | test_an_error_blocks_the_next_command
 * FDPROT from the configuration field; only tightens | yes      | test_a_protected_region_keeps_its_cells
 * failed verification: MGSTAT0                     | yes      | test_cells_that_are_not_erased_fail_verification
 * D-flash unreadable while its command runs        | refused  | test_reading_beside_a_command_is_refused
 * P-flash readable meanwhile                       | yes      | test_a_drive_remembers_what_it_has_identified
 * no command in HSRUN                              | refused  | test_a_command_in_high_speed_run_is_refused
 * a reset ends a command half done                 | yes      | test_a_cut_command_leaves_uncertain_cells
 * uncorrectable phrase: DFDIF and a bus fault      | yes      | test_an_uncorrectable_phrase_is_a_bus_fault
 * bus fault ignored with FAULTMASK and BFHFNMIGN   | yes      | test_a_drive_remembers_what_it_has_identified
 * code cache and speculation keep old cells        | refused  | test_a_cached_read_of_changed_cells_is_refused
 * other commands, P-flash, EEPROM, interrupts      | refused  | test_other_commands_are_refused
 * single-bit correction, margin levels, retention  | no       | -
 */
#include <string.h>

#include "data_flash.h"

enum {
    FSTAT = 0x00,
    FCNFG = 0x01,
    FCCOB_FIRST = 0x04,
    FCCOB_LAST = 0x0F,
    ADDRESS_LOW = 0x04,
    ADDRESS_MIDDLE = 0x05,
    ADDRESS_HIGH = 0x06,
    COMMAND = 0x07,
    DATA = 0x08,
    FDPROT = 0x17,
    FERSTAT = 0x2E,
    FERCNFG = 0x2F,
    CCIF = 0x80,
    RDCOLERR = 0x40,
    ACCERR = 0x20,
    FPVIOL = 0x10,
    MGSTAT0 = 0x01,
    DFDIF = 0x02,
    PROGRAM_PHRASE = 0x07,
    ERASE_SECTOR = 0x09,
    ON_DATA_FLASH = 0x80,
    PROTECTED_BYTES = DATA_FLASH_SIZE / 8,
    CONFIGURED_FDPROT = 0x40F, /* of the program flash */
};

static const peripheral_t *ftfc(void)
{
    return PERIPHERAL(FTFC);
}

bool ftfc_models(uint32_t offset)
{
    return offset <= FCCOB_LAST || offset == FDPROT || offset == FERSTAT;
}

uint32_t ftfc_read(emu_t *emu, const peripheral_t *self, uint32_t offset, uint32_t stored)
{
    (void)emu, (void)self, (void)offset;
    return stored;
}

void ftfc_reset(emu_t *emu)
{
    uint8_t protection = 0xFF;
    (void)uc_mem_read(emu->uc, CONFIGURED_FDPROT, &protection, 1);
    bus_put(emu, ftfc(), FDPROT, protection);
}

/* Other codes exist; what they do is not modelled. */
static bool is_other_command(uint32_t code)
{
    static const uint8_t known[] = {0x00, 0x01, 0x02, 0x03, 0x08, 0x0B, 0x40, 0x41,
                                    0x43, 0x44, 0x45, 0x49, 0x4A, 0x80, 0x81};
    return memchr(known, (int)code, sizeof known) != NULL;
}

static uint32_t error_of(const emu_t *emu, const ftfc_t *c)
{
    const uint32_t alignment = c->code == ERASE_SECTOR ? 16U : DATA_FLASH_PHRASE;
    if ((c->code != PROGRAM_PHRASE && c->code != ERASE_SECTOR) || c->address % alignment != 0U ||
        c->address >= DATA_FLASH_SIZE) {
        return ACCERR;
    }
    const uint32_t region = c->address / PROTECTED_BYTES;
    return (bus_get(emu, ftfc(), FDPROT) >> region & 1U) == 0U ? FPVIOL : 0U;
}

static void launch(emu_t *emu, const peripheral_t *self)
{
    ftfc_t *c = &emu->s.ftfc;
    c->code = (uint8_t)bus_get(emu, self, COMMAND);
    c->address = (bus_get(emu, self, ADDRESS_HIGH) & 0x7FU) << 16 | bus_get(emu, self, ADDRESS_MIDDLE) << 8 |
                 bus_get(emu, self, ADDRESS_LOW);
    for (uint32_t k = 0; k < DATA_FLASH_PHRASE; k++) {
        c->data[k] = (uint8_t)bus_get(emu, self, DATA + k);
    }
    if (clocks_high_speed(emu)) {
        emu_fail(emu, "FTFC: a command must not be launched in HSRUN");
    } else if (is_other_command(c->code)) {
        emu_fail(emu, "FTFC: command 0x%02x is not modelled", c->code);
    } else if ((bus_get(emu, self, ADDRESS_HIGH) & ON_DATA_FLASH) == 0U) {
        emu_fail(emu, "FTFC: a command on the program flash is not modelled");
    }
    const uint32_t error = error_of(emu, c);
    bus_put(emu, self, FSTAT, error != 0U ? CCIF | error : 0U);
    if (error == 0U) {
        c->start = emu->s.now;
        c->end = c->start + data_flash_duration(emu, c->code == ERASE_SECTOR);
        emu_timer(emu, TIMER_FTFC, c->end);
    }
}

static void status_written(emu_t *emu, const peripheral_t *self, uint32_t old, uint32_t value)
{
    bus_put(emu, self, FSTAT, old & ~(value & (RDCOLERR | ACCERR | FPVIOL)));
    if ((value & CCIF) != 0U && (old & CCIF) != 0U && (old & (ACCERR | FPVIOL)) == 0U) {
        launch(emu, self);
    }
}

void ftfc_written(emu_t *emu, const peripheral_t *self, uint32_t offset, uint32_t old, uint32_t value)
{
    if (offset >= FCCOB_FIRST && offset <= FCCOB_LAST && (bus_get(emu, self, FSTAT) & CCIF) == 0U) {
        emu_fail(emu, "write of FTFC offset 0x%x: a command runs, its parameters keep their values", offset);
    } else if (offset == FSTAT) {
        status_written(emu, self, old, value);
    } else if (offset == FCNFG && value != old) {
        emu_fail(emu, "write of FTFC.FCNFG: interrupts and suspending are not modelled");
    } else if (offset == FDPROT) {
        bus_put(emu, self, FDPROT, old & value);
    } else if (offset == FERSTAT) {
        bus_put(emu, self, FERSTAT, old & ~value);
    }
}

static bool apply(emu_t *emu)
{
    const ftfc_t *c = &emu->s.ftfc;
    return c->code == ERASE_SECTOR ? data_flash_erase(emu, c->address) : data_flash_program(emu, c->address, c->data);
}

void ftfc_fire(emu_t *emu)
{
    const bool verified = apply(emu);
    bus_put(emu, ftfc(), FSTAT, CCIF | (verified ? 0U : MGSTAT0));
}

bool ftfc_is_busy(const emu_t *emu)
{
    return (bus_get(emu, ftfc(), FSTAT) & CCIF) == 0U;
}

void ftfc_double_bit_fault(emu_t *emu)
{
    bus_put(emu, ftfc(), FERSTAT, DFDIF);
}

/* Before the reset of everything else: the command that runs ends where it is. */
void ftfc_abort(emu_t *emu)
{
    const ftfc_t *c = &emu->s.ftfc;
    if (!ftfc_is_busy(emu)) {
        return;
    }
    const double done = (double)(emu->s.now - c->start) / (double)(c->end - c->start);
    if (c->code == ERASE_SECTOR) {
        data_flash_erase_cut(emu, c->address, done);
    } else {
        data_flash_program_cut(emu, c->address, c->data, done);
    }
}
