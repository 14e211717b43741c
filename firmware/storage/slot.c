/* SPDX-License-Identifier: Apache-2.0 */
#include "storage/slot.h"

#include <string.h>

#include "signal/crc32.h"

_Static_assert(sizeof(header_t) == STORE_HEADER_SIZE && STORE_HEADER_SIZE % HAL_NVM_UNIT == 0U, "whole flash units");

uint32_t header_crc(const header_t *header)
{
    return crc32_update(CRC32_START, header, STORE_HEADER_SIZE - sizeof header->crc);
}

static bool is_blank_header(const header_t *h)
{
    return (h->layout & h->size & h->sequence & h->crc) == UINT32_MAX;
}

bool is_intact(uint32_t slot, const header_t *header)
{
    uint8_t chunk[CHUNK];
    uint32_t sum = header_crc(header);
    for (uint32_t done = 0; done < header->size; done += CHUNK) {
        const uint32_t now = slot_chunk(header->size - done);
        if (!hal_nvm_read(slot, STORE_HEADER_SIZE + done, chunk, now)) {
            return false;
        }
        sum = crc32_update(sum, chunk, now);
    }
    return ~sum == header->crc;
}

/* 528 bytes with 128 slots, too many for the stack. Only the start and the background use the store, one after the
 * other. */
static struct {
    uint32_t sequence[HAL_NVM_SLOTS];
    uint32_t passed[(HAL_NVM_SLOTS + 31U) / 32U]; /* a bit for each slot that cannot be a record, or is damaged */
} candidates;

static bool is_passed(uint32_t slot)
{
    return (candidates.passed[slot / 32U] & (1U << (slot % 32U))) != 0U;
}

static void pass(uint32_t slot)
{
    candidates.passed[slot / 32U] |= 1U << (slot % 32U);
}

static void read_headers(bool *damaged)
{
    (void)memset(candidates.passed, 0, sizeof candidates.passed);
    for (uint32_t slot = 0; slot < HAL_NVM_SLOTS; slot++) {
        header_t header;
        const bool readable = hal_nvm_read(slot, 0, &header, STORE_HEADER_SIZE);
        if (readable && header.size <= STORE_RECORD_MAX) {
            candidates.sequence[slot] = header.sequence;
        } else {
            pass(slot);
            *damaged = *damaged || !readable || !is_blank_header(&header);
        }
    }
}

/* The slot with the highest sequence number, which may wrap; HAL_NVM_SLOTS: none is left. */
static uint32_t highest(void)
{
    uint32_t found = HAL_NVM_SLOTS;
    for (uint32_t slot = 0; slot < HAL_NVM_SLOTS; slot++) {
        const uint32_t ahead = found < HAL_NVM_SLOTS ? candidates.sequence[slot] - candidates.sequence[found] : 0U;
        found = (!is_passed(slot) && ahead < 0x80000000U) ? slot : found;
    }
    return found;
}

/* Reading the flash takes most of the time of a start. Therefore only the records that may be the newest are read, and
 * none twice: with every slot damaged the watchdog would otherwise reset before the end. */
newest_t find_newest(void)
{
    newest_t newest = {.damaged = false};
    read_headers(&newest.damaged);
    for (newest.slot = highest(); newest.slot < HAL_NVM_SLOTS; newest.slot = highest()) {
        if (hal_nvm_read(newest.slot, 0, &newest.header, STORE_HEADER_SIZE) && newest.header.size <= STORE_RECORD_MAX &&
            is_intact(newest.slot, &newest.header)) {
            return newest;
        }
        pass(newest.slot);
        newest.damaged = true;
    }
    return newest;
}
