/* SPDX-License-Identifier: Apache-2.0 */
#ifndef SIGNAL_CRC32_H
#define SIGNAL_CRC32_H
/** CRC-32 of stored records and of the tables in flash.
 *   polynomial 0x04C11DB7, bits reflected, start value and final inversion 0xFFFFFFFF; "123456789" gives 0xCBF43926
 * Source   IEEE 802.3; the same as zlib's crc32(), which the tools use
 * Units    bytes
 * Range    any size; a long area can be checked in pieces: start with CRC32_START, invert the last result
 * Errors   none
 * Context  start-up and background; two tables of 16 words, a look-up in each per byte */
#include <stdint.h>

#define CRC32_START 0xFFFFFFFFU

/** The register after `size` more bytes; not yet inverted. */
uint32_t crc32_update(uint32_t crc, const void *data, uint32_t size);

static inline uint32_t crc32(const void *data, uint32_t size)
{
    return ~crc32_update(CRC32_START, data, size);
}

#endif
