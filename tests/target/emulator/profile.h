/* SPDX-License-Identifier: Apache-2.0 */
#ifndef EMULATOR_PROFILE_H
#define EMULATOR_PROFILE_H
/** What each run of an exception's handler executes: instructions, and a sum of costs that the caller gives each
 * instruction. A handler that is interrupted is not charged with what interrupts it.
 * Source   docs/performance.md
 * Errors   only in counting mode; else nothing is ever recorded. An instruction without a cost stops the emulation
 * Context  host */
#include <stdbool.h>
#include <stdint.h>

#include "emu.h"

typedef struct {
    uint32_t vector;
    uint32_t instructions;
    uint32_t cost;
} emu_span_t;

/** cost: one byte for each half word of the flash, of the instruction that starts there; taken: more for each
 * instruction that is not followed by its neighbour. Copied. */
EMU_API bool emu_profile_start(emu_t *emu, const uint8_t *cost, uint32_t half_words, uint32_t taken);
/** Moves up to `most` finished runs, the oldest first; the number of runs. */
EMU_API uint32_t emu_profile_take(emu_t *emu, emu_span_t *to, uint32_t most);

#endif
