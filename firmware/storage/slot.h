/* SPDX-License-Identifier: Apache-2.0 */
#ifndef STORAGE_SLOT_H
#define STORAGE_SLOT_H
/** One slot of the store: a header, then a record. The newest slot that is intact.
 *
 * Format   header_t, of STORE_HEADER_SIZE bytes, then `size` bytes of the record
 * Source   docs/decisions/007-store.md
 * Units    bytes
 * Range    slot numbers below HAL_NVM_SLOTS; sequence numbers wrap
 * Errors   a slot that cannot be read, or whose CRC-32 differs, is passed over and reported as damaged
 * Context  start-up and background, never at the same time: the search keeps its state in static memory
 */
#include <stdbool.h>
#include <stdint.h>

#include "storage/store.h"

#define CHUNK 64U /* bytes on the stack at a time; a multiple of HAL_NVM_UNIT */

typedef struct {
    uint32_t layout, size, sequence, crc; /* crc over the three words before it, then the record */
} header_t;

typedef struct {
    uint32_t slot; /* HAL_NVM_SLOTS: there is none */
    header_t header;
    bool damaged; /* a slot is neither blank nor intact */
} newest_t;

/** Size of the next chunk when `left` bytes are left. */
static inline uint32_t slot_chunk(uint32_t left)
{
    return (left < CHUNK) ? left : CHUNK;
}

/** CRC-32 over the header without its crc, to be continued over the record and then inverted. */
uint32_t header_crc(const header_t *header);
/** The header fits the record stored behind it. */
bool is_intact(uint32_t slot, const header_t *header);
/** The intact slot with the highest sequence number. */
newest_t find_newest(void);
#endif
