/* SPDX-License-Identifier: Apache-2.0 */
#ifndef EMULATOR_DATA_FLASH_H
#define EMULATOR_DATA_FLASH_H
/** The cells of the FlexNVM as data flash: what a command leaves in them, complete or cut by a reset, and what a read
 * returns. They survive a reset.
 *   A phrase that a command has left half done is uncertain: each read returns, at random, an uncorrectable error or
 *   the content, whatever that is, so that no program can rely on it.
 * Source   reference manual S32K1xx, flash memory: ECC of 64 bits, D-flash of 64 KiB with sectors of 2 KiB
 * Context  emulator only */
#include "emu_private.h"

bool data_flash_erase(emu_t *emu, uint32_t address);
bool data_flash_program(emu_t *emu, uint32_t address, const uint8_t data[DATA_FLASH_PHRASE]);
/** The command was cut; done: the share of its time that had passed. */
void data_flash_erase_cut(emu_t *emu, uint32_t address, double done);
void data_flash_program_cut(emu_t *emu, uint32_t address, const uint8_t data[DATA_FLASH_PHRASE], double done);
uint64_t data_flash_duration(const emu_t *emu, bool erase);

#endif
