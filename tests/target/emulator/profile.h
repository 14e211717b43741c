/* SPDX-License-Identifier: Apache-2.0 */
#ifndef EMULATOR_PROFILE_H
#define EMULATOR_PROFILE_H
/** For each run of an exception's handler: the number of instructions, and the sum of the costs that the caller assigns
 * to them. Handlers that interrupt it are not included.
 * Source   docs/performance.md
 * Errors   emu_profile_start(): false outside counting mode, and nothing is recorded. emu_profile_memories(): false
 *          without a profile or with costs that memory_time.h refuses. Code without a cost stops the emulation
 * Context  host */
#include <stdbool.h>
#include <stdint.h>

#include "emu.h"
#include "memory_time.h"

enum { EMU_MEMORIES = 2 };

typedef struct {
    uint32_t vector;
    uint32_t instructions;
    uint32_t cost;
    uint32_t waited[EMU_MEMORIES]; /* for each of the two memories of emu_profile_memories() */
} emu_span_t;

/** cost: one byte for each half word of the flash and then of the RAM, the cost of the instruction that starts there;
 * copied. taken: additional cost of an instruction after which another one than the next in memory runs. */
EMU_API bool emu_profile_start(emu_t *emu, const uint8_t *cost, uint32_t half_words, uint32_t taken);
/** Also counts what two memories, the first faster, would let the core wait; after emu_profile_start(). */
EMU_API bool emu_profile_memories(emu_t *emu, const memory_costs_t costs[EMU_MEMORIES]);
/** Moves up to max_count finished runs, the oldest first; returns their number. */
EMU_API uint32_t emu_profile_take(emu_t *emu, emu_span_t *to, uint32_t max_count);

#endif
