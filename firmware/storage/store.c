/* SPDX-License-Identifier: Apache-2.0 */
#include "storage/store.h"

#include "signal/crc32.h"

#define CHUNK 64U /* bytes on the stack at a time; a multiple of HAL_NVM_UNIT */

typedef struct {
    uint32_t layout, size, sequence, crc; /* crc over the three words before it, then the record */
} header_t;

_Static_assert(sizeof(header_t) == STORE_HEADER_SIZE && STORE_HEADER_SIZE % HAL_NVM_UNIT == 0, "whole flash units");

typedef enum { SLOT_BLANK, SLOT_DAMAGED, SLOT_INTACT } slot_state_t;

typedef struct {
    slot_state_t state;
    header_t header;
} slot_t;

static uint32_t header_crc(const header_t *header)
{
    return crc32_update(CRC32_START, header, STORE_HEADER_SIZE - sizeof header->crc);
}

/* CRC of header and stored record; false: not readable. */
static bool stored_crc(uint32_t slot, const header_t *header, uint32_t *crc)
{
    uint8_t chunk[CHUNK];
    uint32_t sum = header_crc(header);
    for (uint32_t done = 0; done < header->size; done += CHUNK) {
        const uint32_t left = header->size - done;
        const uint32_t size_now = (left < CHUNK) ? left : CHUNK;
        if (!hal_nvm_read(slot, STORE_HEADER_SIZE + done, chunk, size_now)) {
            return false;
        }
        sum = crc32_update(sum, chunk, size_now);
    }
    *crc = ~sum;
    return true;
}

static slot_t check_slot(uint32_t slot)
{
    slot_t result = {.state = SLOT_DAMAGED};
    uint32_t crc = 0;
    if (!hal_nvm_read(slot, 0, &result.header, STORE_HEADER_SIZE)) {
        return result;
    }
    const header_t *h = &result.header;
    if (h->layout == UINT32_MAX && h->size == UINT32_MAX && h->sequence == UINT32_MAX && h->crc == UINT32_MAX) {
        result.state = SLOT_BLANK;
    } else if (h->size <= STORE_RECORD_MAX && stored_crc(slot, h, &crc) && crc == h->crc) {
        result.state = SLOT_INTACT;
    }
    return result;
}

/* The slot with the newest intact record; HAL_NVM_SLOTS if there is none. The sequence may wrap. */
static uint32_t newest(const slot_t slot[HAL_NVM_SLOTS])
{
    if (slot[0].state != SLOT_INTACT) {
        return (slot[1].state == SLOT_INTACT) ? 1U : HAL_NVM_SLOTS;
    }
    if (slot[1].state != SLOT_INTACT) {
        return 0U;
    }
    return (slot[1].header.sequence - slot[0].header.sequence < 0x80000000U) ? 1U : 0U;
}

store_result_t store_load(uint32_t layout, void *record, uint32_t size)
{
    const slot_t slot[HAL_NVM_SLOTS] = {check_slot(0), check_slot(1)};
    const uint32_t newest_slot = newest(slot);
    if (newest_slot == HAL_NVM_SLOTS) {
        const bool damaged = slot[0].state == SLOT_DAMAGED || slot[1].state == SLOT_DAMAGED;
        return damaged ? STORE_DAMAGED : STORE_EMPTY;
    }
    if (slot[newest_slot].header.layout != layout || slot[newest_slot].header.size != size) {
        return STORE_EMPTY;
    }
    return hal_nvm_read(newest_slot, STORE_HEADER_SIZE, record, size) ? STORE_OK : STORE_DAMAGED;
}

static bool program_record(uint32_t slot, const uint8_t *record, uint32_t size)
{
    for (uint32_t done = 0; done < size; done += CHUNK) {
        uint8_t chunk[CHUNK];
        for (uint32_t k = 0; k < CHUNK; k++) {
            chunk[k] = (done + k < size) ? record[done + k] : 0xFFU;
        }
        const uint32_t left = size - done;
        const uint32_t used = (left < CHUNK) ? left : CHUNK;
        const uint32_t whole = (used + HAL_NVM_UNIT - 1U) / HAL_NVM_UNIT * HAL_NVM_UNIT;
        if (!hal_nvm_program(slot, STORE_HEADER_SIZE + done, chunk, whole)) {
            return false;
        }
    }
    return true;
}

bool store_save(uint32_t layout, const void *record, uint32_t size)
{
    const slot_t slot[HAL_NVM_SLOTS] = {check_slot(0), check_slot(1)};
    const uint32_t newest_slot = newest(slot);
    const uint32_t target = (newest_slot == 0U) ? 1U : 0U;
    header_t header = {.layout = layout, .size = size};
    if (size > STORE_RECORD_MAX) {
        return false;
    }
    header.sequence = (newest_slot == HAL_NVM_SLOTS) ? 0U : slot[newest_slot].header.sequence + 1U;
    header.crc = ~crc32_update(header_crc(&header), record, size);
    return hal_nvm_erase(target) && program_record(target, record, size) &&
           hal_nvm_program(target, 0, &header, STORE_HEADER_SIZE) && check_slot(target).state == SLOT_INTACT;
}
