/* SPDX-License-Identifier: Apache-2.0 */
#ifndef EMULATOR_PASSES_PRIVATE_H
#define EMULATOR_PASSES_PRIVATE_H
/** passes.c as the profile uses it: `depth` is the number of handlers that run, 0 for the background.
 * Context  host */
#include "passes.h"

typedef struct passes passes_t;

passes_t *passes_create(const uint16_t *of, uint32_t half_words, const emu_region_t *regions, uint32_t count);
void passes_destroy(passes_t *passes);
void passes_enter(passes_t *passes, int depth);
void passes_instruction(passes_t *passes, int depth, uint32_t address);
void passes_most(const passes_t *passes, uint32_t *most);
void passes_ran(const passes_t *passes, uint8_t *ran, uint32_t half_words);

#endif
