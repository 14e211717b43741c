/* SPDX-License-Identifier: Apache-2.0 */
/* The record that survives a power cycle: storage/store on a flash memory that may have any content and may fail in any
 * operation. crc32_update() returns any value, so that no property relies on the CRC to detect damage. Records are at
 * most 64 bytes long, which is one piece. */
#include "proof.h"

#include "storage/slot.c"
#include "storage/store.c"

#define LONGEST 64U

static uint32_t erased; /* one bit for each slot */
static uint32_t programmed;
static const header_t *stored; /* the headers, unless every read may return anything */

uint32_t crc32_update(uint32_t crc, const void *data, uint32_t size)
{
    uint32_t any;
    PROVE(__CPROVER_r_ok(data, size));
    (void)crc;
    return any;
}

bool hal_nvm_read(uint32_t slot, uint32_t offset, void *data, uint32_t size)
{
    PROVE(slot < HAL_NVM_SLOTS && offset <= HAL_NVM_SLOT_SIZE && size <= HAL_NVM_SLOT_SIZE - offset);
    PROVE(__CPROVER_w_ok(data, size));
    if (stored != 0) {
        *(header_t *)data = stored[slot];
        return true;
    }
    __CPROVER_havoc_slice(data, size);
    if (offset == 0U) {
        ASSUME(((header_t *)data)->size <= LONGEST || ((header_t *)data)->size > STORE_RECORD_MAX);
    }
    return nondet_bool();
}

bool hal_nvm_erase(uint32_t slot)
{
    PROVE(slot < HAL_NVM_SLOTS);
    erased |= 1U << slot;
    return nondet_bool();
}

bool hal_nvm_program(uint32_t slot, uint32_t offset, const void *data, uint32_t size)
{
    PROVE(slot < HAL_NVM_SLOTS && offset <= HAL_NVM_SLOT_SIZE && size <= HAL_NVM_SLOT_SIZE - offset);
    PROVE(size % HAL_NVM_UNIT == 0U && offset % HAL_NVM_UNIT == 0U);
    PROVE(__CPROVER_r_ok(data, size));
    PROVE((erased & 1U << slot) != 0U);
    programmed |= 1U << slot;
    return nondet_bool();
}

void proof_store_load_stays_inside_the_record(void)
{
    uint8_t record[LONGEST], size;
    uint32_t layout;
    ASSUME(size <= LONGEST);
    const store_result_t result = store_load(layout, record, size);
    PROVE(result == STORE_OK || result == STORE_EMPTY || result == STORE_DAMAGED);
    PROVE(erased == 0U && programmed == 0U);
}

void proof_store_save_changes_one_slot(void)
{
    uint8_t record[LONGEST], size;
    uint32_t layout, failed_sectors = 0;
    ASSUME(size <= LONGEST);
    (void)store_save(layout, record, size, &failed_sectors);
    PROVE(erased != 3U && (programmed & ~erased) == 0U);
}

void proof_store_newest_header_is_found(void)
{
    header_t header[HAL_NVM_SLOTS];
    bool damaged = false;
    stored = header;
    read_headers(&damaged);
    const uint32_t found = highest();
    const bool first = header[0].size <= STORE_RECORD_MAX, second = header[1].size <= STORE_RECORD_MAX;
    PROVE(found <= HAL_NVM_SLOTS && (found == HAL_NVM_SLOTS) == (!first && !second));
    PROVE(found == HAL_NVM_SLOTS || header[found].size <= STORE_RECORD_MAX);
    if (first && second && header[1].sequence == header[0].sequence + 1U) {
        PROVE(found == 1U);
    }
    if (first && second && header[0].sequence == header[1].sequence + 1U) {
        PROVE(found == 0U);
    }
}
