/* SPDX-License-Identifier: Apache-2.0 */
#include "passes.h"

#include <stdlib.h>
#include <string.h>

#include "emu_private.h"
#include "passes_private.h"

enum { REGIONS_MAX = 1024 };

struct passes {
    uint16_t of[CODE_SIZE / 2];
    uint8_t ran[CODE_SIZE / 2];
    emu_region_t region[REGIONS_MAX];
    uint32_t regions;
    uint32_t runs[NEST_MAX + 1][REGIONS_MAX]; /* of the headers, since the regions were entered */
    uint16_t last[NEST_MAX + 1];
    uint32_t most[REGIONS_MAX];
};

passes_t *passes_create(const uint16_t *of, uint32_t half_words, const emu_region_t *regions, uint32_t count)
{
    if (half_words > CODE_SIZE / 2 || count > REGIONS_MAX) {
        return NULL;
    }
    passes_t *passes = calloc(1, sizeof *passes);
    if (passes != NULL) {
        memcpy(passes->of, of, half_words * sizeof *of);
        memcpy(passes->region, regions, count * sizeof *regions);
        passes->regions = count;
    }
    return passes;
}

void passes_destroy(passes_t *passes)
{
    free(passes);
}

void passes_enter(passes_t *passes, int depth)
{
    memset(passes->runs[depth], 0, sizeof passes->runs[depth]);
    passes->last[depth] = 0;
}

/* What this region is not within has been left. */
static void leave_others(passes_t *passes, int depth, uint16_t region)
{
    const uint16_t root = passes->region[region].root;
    for (uint16_t k = root; k < passes->region[root].end; k++) {
        if (k > region || region >= passes->region[k].end) {
            passes->runs[depth][k] = 0;
        }
    }
    passes->last[depth] = region;
}

void passes_instruction(passes_t *passes, int depth, uint32_t address)
{
    const uint32_t place = code_place(address);
    const uint16_t region = place < CODE_SIZE / 2 ? passes->of[place] : (uint16_t)0;
    if (depth == 0 || region == 0U) {
        return;
    }
    passes->ran[place] = 1;
    if (passes->last[depth] != region) {
        leave_others(passes, depth, region);
    }
    if (passes->region[region].header == address) {
        const uint32_t runs = ++passes->runs[depth][region];
        passes->most[region] = runs > passes->most[region] ? runs : passes->most[region];
    }
}

void passes_most(const passes_t *passes, uint32_t *most)
{
    memcpy(most, passes->most, passes->regions * sizeof *most);
}

void passes_ran(const passes_t *passes, uint8_t *ran, uint32_t half_words)
{
    memcpy(ran, passes->ran, half_words < CODE_SIZE / 2 ? half_words : CODE_SIZE / 2);
}
