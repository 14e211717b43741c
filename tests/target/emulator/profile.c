/* SPDX-License-Identifier: Apache-2.0 */
#include "profile.h"

#include <stdlib.h>
#include <string.h>

#include "emu_private.h"
#include "passes_private.h"

enum { SPANS_MAX = 1 << 16, NOWHERE = -1 };

typedef struct {
    emu_span_t span;
    int64_t next; /* address of the instruction that follows the last one in memory */
} level_t;

struct profile {
    level_t level[NEST_MAX + 1]; /* the first is the background */
    int depth;
    emu_span_t done[SPANS_MAX];
    uint32_t count;
    uint32_t taken;
    uint8_t cost[CODE_SIZE / 2];
    bool conditional[CODE_SIZE / 2]; /* made conditional by an IT that has run: counted with the IT */
    memory_time_t *memory[EMU_MEMORIES];
    passes_t *passes; /* NULL: not requested */
};

bool emu_profile_start(emu_t *emu, const uint8_t *cost, uint32_t half_words, uint32_t taken)
{
    if (emu->mode != EMU_COUNTING || half_words > CODE_SIZE / 2 || !emu_data_watch(emu)) {
        return false;
    }
    profile_stop(emu);
    emu->profile = calloc(1, sizeof *emu->profile);
    if (emu->profile == NULL) {
        return false;
    }
    memcpy(emu->profile->cost, cost, half_words);
    emu->profile->taken = taken;
    emu->profile->depth = (int)emu->s.nvic.nest;
    return true;
}

uint32_t emu_profile_take(emu_t *emu, emu_span_t *to, uint32_t max_count)
{
    profile_t *p = emu->profile;
    const uint32_t count = p == NULL ? 0 : p->count < max_count ? p->count : max_count;
    if (count > 0) {
        memcpy(to, p->done, count * sizeof *to);
        memmove(p->done, p->done + count, (p->count - count) * sizeof *to);
        p->count -= count;
    }
    return count;
}

void profile_stop(emu_t *emu)
{
    profile_t *p = emu->profile;
    for (int k = 0; p != NULL && k < EMU_MEMORIES; k++) {
        memory_time_destroy(p->memory[k]);
    }
    if (p != NULL) {
        passes_destroy(p->passes);
    }
    free(p);
    emu->profile = NULL;
}

void profile_access(emu_t *emu, uint32_t address, uint32_t size, bool store)
{
    profile_t *p = emu->profile;
    for (int k = 0; k < EMU_MEMORIES && p->memory[k] != NULL; k++) {
        p->level[p->depth].span.waited[k] += memory_time_access(p->memory[k], address, size, store);
    }
}

bool emu_profile_memories(emu_t *emu, const memory_costs_t costs[EMU_MEMORIES])
{
    profile_t *p = emu->profile;
    if (p == NULL || p->memory[0] != NULL) {
        return false;
    }
    memory_time_t *first = memory_time_create(&costs[0]), *second = memory_time_create(&costs[1]);
    if (first == NULL || second == NULL) {
        memory_time_destroy(first);
        memory_time_destroy(second);
        return false;
    }
    p->memory[0] = first;
    p->memory[1] = second;
    return true;
}

bool emu_profile_passes(emu_t *emu, const uint16_t *of, uint32_t half_words, const emu_region_t *regions,
                        uint32_t count)
{
    profile_t *p = emu->profile;
    if (p == NULL || p->passes != NULL) {
        return false;
    }
    p->passes = passes_create(of, half_words, regions, count);
    return p->passes != NULL;
}

void emu_profile_most_passes(const emu_t *emu, uint32_t *most)
{
    passes_most(emu->profile->passes, most);
}

void emu_profile_ran(const emu_t *emu, uint8_t *ran, uint32_t half_words)
{
    passes_ran(emu->profile->passes, ran, half_words);
}

static void fetch(const profile_t *p, emu_span_t *span, uint32_t address, uint32_t size)
{
    for (int k = 0; k < EMU_MEMORIES && p->memory[k] != NULL; k++) {
        span->waited[k] += memory_time_fetch(p->memory[k], address, size);
    }
}

static uint32_t cost_of(emu_t *emu, uint32_t address)
{
    const uint32_t place = code_place(address);
    const uint32_t cost = place < CODE_SIZE / 2 ? emu->profile->cost[place] : 0U;
    if (cost == 0U) {
        emu_fail(emu, "the instruction at 0x%08x ran, but no cost was given for it", address);
    }
    return cost;
}

static bool is_conditional(const profile_t *p, int64_t address)
{
    const uint32_t place = code_place((uint32_t)address);
    return place < CODE_SIZE / 2 && p->conditional[place];
}

/* The emulated core does not report skipped instructions. Therefore all instructions that an IT makes conditional are
 * counted together with the IT. */
static void count_conditional(emu_t *emu, emu_span_t *span, uint32_t address, uint32_t slots)
{
    for (uint32_t at = address; slots > 0 && code_place(at) < CODE_SIZE / 2; slots--) {
        uint8_t code[2] = {0, 0};
        (void)uc_mem_read(emu->uc, at, code, sizeof code);
        const uint32_t size = code[1] >= THUMB_32BIT ? 4U : 2U;
        emu->profile->conditional[code_place(at)] = true;
        span->instructions++;
        span->cost += cost_of(emu, at);
        fetch(emu->profile, span, at, size);
        at += size;
    }
}

void profile_instruction(emu_t *emu, uint32_t address, uint32_t size)
{
    profile_t *p = emu->profile;
    level_t *level = &p->level[p->depth];
    if (level->next != NOWHERE && level->next != address && !is_conditional(p, level->next)) {
        level->span.cost += p->taken; /* for the previous instruction */
    }
    level->next = (int64_t)address + size;
    if (p->passes != NULL) {
        passes_instruction(p->passes, p->depth, address);
    }
    if (is_conditional(p, address)) {
        return;
    }
    level->span.instructions++;
    level->span.cost += cost_of(emu, address);
    fetch(p, &level->span, address, size);
    if (code_place(address) < CODE_SIZE / 2) {
        count_conditional(emu, &level->span, address + size, emu->block[code_place(address)].conditional);
    }
}

void profile_enter(emu_t *emu, int vector, uint32_t stack, uint32_t words)
{
    profile_t *p = emu->profile;
    if (p->depth < NEST_MAX) {
        p->depth++;
    }
    level_t *level = &p->level[p->depth];
    *level = (level_t){.span = {.vector = (uint32_t)vector}, .next = NOWHERE};
    if (p->passes != NULL) {
        passes_enter(p->passes, p->depth);
    }
    const uint32_t at = emu->s.nvic.vtor + 4U * (uint32_t)vector;
    for (int k = 0; k < EMU_MEMORIES && p->memory[k] != NULL; k++) {
        level->span.waited[k] = memory_time_entry(p->memory[k], at, stack, words);
    }
}

void profile_leave(emu_t *emu, uint32_t stack, uint32_t words)
{
    profile_t *p = emu->profile;
    emu_span_t *span = &p->level[p->depth].span;
    for (int k = 0; k < EMU_MEMORIES && p->memory[k] != NULL; k++) {
        span->waited[k] += memory_time_return(p->memory[k], stack, words);
    }
    if (p->count < SPANS_MAX && p->depth > 0) {
        p->done[p->count++] = *span;
    }
    p->depth = p->depth > 0 ? p->depth - 1 : 0;
}
