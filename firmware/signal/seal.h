/* SPDX-License-Identifier: Apache-2.0 */
#ifndef SIGNAL_SEAL_H
#define SIGNAL_SEAL_H
/** A checksum (seal) of a few words that only their owner writes. The owner computes it after each write and compares
 * it before the next use, which finds errors of the memory in between.
 *   s <- word xor (s rotated right by one bit), over all words
 * Source   docs/theory/data-integrity.md (DI-3)
 * Units    none: words of 32 bits
 * Range    any number of aligned words; size in bytes
 * Errors   none; every single flipped bit changes the seal. So do two flipped bits, unless the sum of bit number and
 *          word number is the same for both modulo 32
 * Context  any; about three instructions for each word, a CRC would take some fifty */
#include <stdint.h>

#define SEAL_START UINT32_MAX

/** The seal with one word more. */
static inline uint32_t seal_add(uint32_t seal, uint32_t word)
{
    return word ^ (seal >> 1 | seal << 31);
}

/** The seal of `size` bytes of words. */
uint32_t seal_of(const void *data, uint32_t size);

#endif
