/* SPDX-License-Identifier: Apache-2.0 */
#ifndef EMULATOR_MEMORY_TIME_H
#define EMULATOR_MEMORY_TIME_H
/** How many cycles the core waits for its memories: flash behind the code cache, SRAM on two buses, peripherals.
 *
 * The counts come on top of the Technical Reference Manual's, which are those of memories without wait states. Nothing
 * overlaps: each wait is charged in full.
 *   cached    an access to the flash whose line is in the code cache costs nothing, any other one a line fill
 *   read ahead  the flash has read the line that follows the last one it delivered: a fill of that line costs less
 *   buses     SRAM_L and the flash are on the bus on which instructions are fetched, SRAM_U and peripherals are not
 * Source   tools/fluxtrue_tools/bench/memory.py has every number with its origin
 * Errors   memory_time_create(): NULL without memory, or if the geometry is not one of powers of two
 * Context  host */
#include <stdbool.h>
#include <stdint.h>

#include "emu.h"

/** Cycles that are waited, unless the name says otherwise. */
typedef struct {
    uint32_t sets, ways, line_bytes; /* of the code cache; the least recently used line is replaced */
    uint32_t fill;                   /* a line from the flash */
    uint32_t fill_ahead;             /* the same if it has been read ahead */
    uint32_t fetch_ahead_bytes;      /* what the core fetches beyond the instruction that runs */
    uint32_t code_bus;               /* an access to data on the bus of the instructions */
    uint32_t narrow_store;           /* a store of less than a word to the SRAM */
    uint32_t peripheral;             /* an access by way of a peripheral bridge */
    uint32_t hidden_at_entry;        /* of what an exception's entry waits, behind the cycles it takes anyway */
} memory_costs_t;

typedef struct memory_time memory_time_t;

EMU_API memory_time_t *memory_time_create(const memory_costs_t *costs);
EMU_API void memory_time_destroy(memory_time_t *memory);
EMU_API uint32_t memory_time_fetch(memory_time_t *memory, uint32_t address, uint32_t size);
EMU_API uint32_t memory_time_access(memory_time_t *memory, uint32_t address, uint32_t size, bool store);
/** Entry and return of an exception with this number of words on the stack. */
EMU_API uint32_t memory_time_entry(memory_time_t *memory, uint32_t vector_address, uint32_t stack, uint32_t words);
EMU_API uint32_t memory_time_return(const memory_time_t *memory, uint32_t stack, uint32_t words);

#endif
