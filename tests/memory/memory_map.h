/* SPDX-License-Identifier: Apache-2.0 */
#ifndef MEMORY_MEMORY_MAP_H
#define MEMORY_MEMORY_MAP_H
/** The blocks of the ECU's state by name, for the table of the campaign. Context: test program. */
#include <stdint.h>

#define MEMORY_BLOCKS_MAX 64U

typedef struct {
    uint32_t byte, bit; /* of ecu_t */
} place_t;

/** The block of a byte of ecu_t. */
unsigned memory_block(uint32_t byte);
/** NULL after the last. */
const char *memory_block_name(unsigned block);
uint32_t memory_block_offset(unsigned block);

#endif
