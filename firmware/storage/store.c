/* SPDX-License-Identifier: Apache-2.0 */
#include "storage/store.h"

#include "signal/crc32.h"
#include "storage/slot.h"

#define ATTEMPTS 4U /* of a save, each in another sector: an erase may take more than a tenth of a second */

_Static_assert(HAL_NVM_SLOTS % HAL_NVM_SECTOR_SLOTS == 0U && HAL_NVM_SLOTS >= 2U * HAL_NVM_SECTOR_SLOTS,
               "while a sector is erased, another one holds the newest record");

store_result_t store_load(uint32_t layout, void *record, uint32_t size)
{
    const newest_t newest = find_newest();
    if (newest.slot == HAL_NVM_SLOTS) {
        return newest.damaged ? STORE_DAMAGED : STORE_EMPTY;
    }
    if (newest.header.layout != layout || newest.header.size != size) {
        return STORE_EMPTY;
    }
    return hal_nvm_read(newest.slot, STORE_HEADER_SIZE, record, size) ? STORE_OK : STORE_DAMAGED;
}

static bool program_record(uint32_t slot, const uint8_t *record, uint32_t size)
{
    for (uint32_t done = 0; done < size; done += CHUNK) {
        uint8_t chunk[CHUNK];
        for (uint32_t k = 0; k < CHUNK; k++) {
            chunk[k] = (done + k < size) ? record[done + k] : 0xFFU;
        }
        const uint32_t used = slot_chunk(size - done);
        const uint32_t whole = (used + HAL_NVM_UNIT - 1U) / HAL_NVM_UNIT * HAL_NVM_UNIT;
        if (!hal_nvm_program(slot, STORE_HEADER_SIZE + done, chunk, whole)) {
            return false;
        }
    }
    return true;
}

static bool write_slot(uint32_t slot, const header_t *header, const void *record)
{
    return program_record(slot, record, header->size) && hal_nvm_program(slot, 0, header, STORE_HEADER_SIZE) &&
           is_intact(slot, header);
}

#if HAL_NVM_SECTOR_SLOTS > 1U
/* Whether nothing has been programmed since the sector was erased. */
static bool is_blank(uint32_t slot)
{
    uint8_t chunk[CHUNK];
    for (uint32_t done = 0; done < HAL_NVM_SLOT_SIZE; done += CHUNK) {
        if (!hal_nvm_read(slot, done, chunk, CHUNK)) {
            return false;
        }
        for (uint32_t k = 0; k < CHUNK; k++) {
            if (chunk[k] != 0xFFU) {
                return false;
            }
        }
    }
    return true;
}
#endif

/* Whether the slot takes a record: it is the first of a sector, or blank. */
static bool is_free(uint32_t slot)
{
#if HAL_NVM_SECTOR_SLOTS > 1U
    return slot % HAL_NVM_SECTOR_SLOTS == 0U || is_blank(slot);
#else
    (void)slot;
    return true;
#endif
}

static bool prepare(uint32_t slot)
{
    return slot % HAL_NVM_SECTOR_SLOTS != 0U || hal_nvm_erase(slot);
}

/* Tries the slots after the newest record, as far as the sector before that of the newest record. If a slot fails, the
 * rest of its sector is skipped, because it would fail again at each save. The sequence number advances with the slot
 * number, so that it shows how often the sectors were erased. */
bool store_save(uint32_t layout, const void *record, uint32_t size, uint32_t *failed_sectors)
{
    const newest_t newest = find_newest();
    const bool first = newest.slot == HAL_NVM_SLOTS;
    header_t header = {.layout = layout, .size = size};
    if (size > STORE_RECORD_MAX) {
        return false;
    }
    uint32_t attempts = 0;
    uint32_t failed = HAL_NVM_SLOTS; /* the last sector that failed; no sector has this number */
    for (uint32_t k = 0; k < HAL_NVM_SLOTS - HAL_NVM_SECTOR_SLOTS && attempts < ATTEMPTS; k++) {
        const uint32_t slot = first ? k : (newest.slot + 1U + k) % HAL_NVM_SLOTS;
        header.sequence = first ? k : newest.header.sequence + 1U + k;
        header.crc = ~crc32_update(header_crc(&header), record, size);
        if (slot / HAL_NVM_SECTOR_SLOTS != failed && is_free(slot)) {
            if (prepare(slot) && write_slot(slot, &header, record)) {
                return true;
            }
            failed = slot / HAL_NVM_SECTOR_SLOTS;
            *failed_sectors += 1U;
            attempts++;
        }
    }
    return false;
}

uint32_t store_erase_cycles(void)
{
    const newest_t newest = find_newest();
    return (newest.slot == HAL_NVM_SLOTS) ? 0U : newest.header.sequence / HAL_NVM_SLOTS + 1U;
}
