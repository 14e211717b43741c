/* SPDX-License-Identifier: Apache-2.0 */
#ifndef STORAGE_STORE_H
#define STORAGE_STORE_H
/** One record that survives a power cycle.
 *   Each slot: header {layout, size, sequence, crc}, then the record. A save writes the next blank slot after the one
 *   with the newest record, the header last, and erases a sector when it reaches its first slot, never the one with the
 *   newest record. A power cut at any byte therefore leaves either the previous or the new record intact. A slot that
 *   is not blank, for example because a cut left it half written, is passed over, and so is the rest of a sector that
 *   cannot be erased or programmed, up to four of them in a save.
 * Source   docs/decisions/007-store.md
 * Units    bytes
 * Range    size <= STORE_RECORD_MAX; layout names the record's meaning: a record of another layout is not found
 * Errors   store_load(): STORE_EMPTY, no record was saved with this layout; STORE_DAMAGED, there are records but none
 *          is intact; the caller's record changes only with STORE_OK. store_save(): false, the memory failed to erase,
 *          program or verify; the previous record is still valid
 * Context  background, below every interrupt; the caller copies a consistent record first */
#include <stdbool.h>
#include <stdint.h>

#include "hal/nvm.h"

#define STORE_HEADER_SIZE 16U
#define STORE_RECORD_MAX (HAL_NVM_SLOT_SIZE - STORE_HEADER_SIZE)

typedef enum { STORE_OK = 0, STORE_EMPTY = 1, STORE_DAMAGED = 2 } store_result_t;

store_result_t store_load(uint32_t layout, void *record, uint32_t size);
/** *failed_sectors is increased by the number of sectors that failed to erase, program or verify. */
bool store_save(uint32_t layout, const void *record, uint32_t size, uint32_t *failed_sectors);
/** How often the sector that is used most has been erased, for a comparison with what the flash withstands. */
uint32_t store_erase_cycles(void);

#endif
