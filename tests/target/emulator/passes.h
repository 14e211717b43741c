/* SPDX-License-Identifier: Apache-2.0 */
#ifndef EMULATOR_PASSES_H
#define EMULATOR_PASSES_H
/** How often handlers run the header of each loop each time the loop is entered, and which instructions they run.
 * A region is a loop, or what a function has outside its loops. The regions of a function follow each other, the one
 * outside the loops first and each loop before those within it; region 0 is none.
 * Source   docs/theory/worst-case-time.md
 * Errors   emu_profile_passes(): false without a profile, with too many regions or without memory
 * Context  host */
#include <stdbool.h>
#include <stdint.h>

#include "emu.h"

typedef struct {
    uint32_t header; /* address; 0 outside the loops */
    uint16_t root;   /* the region outside the loops of the same function */
    uint16_t end;    /* the first region that is not within this one */
} emu_region_t;

/** of: the region of each half word of the flash and then of the RAM; copied. After emu_profile_start(). */
EMU_API bool emu_profile_passes(emu_t *emu, const uint16_t *of, uint32_t half_words, const emu_region_t *regions,
                                uint32_t count);
/** For each region the most runs of its header since it was entered. */
EMU_API void emu_profile_most_passes(const emu_t *emu, uint32_t *most);
/** For each half word, whether a handler has run the instruction that begins there. */
EMU_API void emu_profile_ran(const emu_t *emu, uint8_t *ran, uint32_t half_words);

#endif
