/* SPDX-License-Identifier: Apache-2.0 */
#include "profile.h"

#include <stdlib.h>
#include <string.h>

#include "emu_private.h"

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
    uint8_t cost[FLASH_SIZE / 2];
    bool conditional[FLASH_SIZE / 2]; /* made conditional by an IT that has run: counted with the IT */
};

bool emu_profile_start(emu_t *emu, const uint8_t *cost, uint32_t half_words, uint32_t taken)
{
    if (emu->mode != EMU_COUNTING || half_words > FLASH_SIZE / 2) {
        return false;
    }
    profile_stop(emu);
    emu->profile = calloc(1, sizeof *emu->profile);
    if (emu->profile == NULL) {
        return false;
    }
    memcpy(emu->profile->cost, cost, half_words);
    emu->profile->taken = taken;
    emu->profile->depth = emu->s.nvic.nest;
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
    free(emu->profile);
    emu->profile = NULL;
}

static uint32_t cost_of(emu_t *emu, uint32_t address)
{
    const uint32_t cost = address < FLASH_SIZE ? emu->profile->cost[address / 2U] : 0U;
    if (cost == 0U) {
        emu_fail(emu, "the instruction at 0x%08x ran, but no cost was given for it", address);
    }
    return cost;
}

static bool is_conditional(const profile_t *p, int64_t address)
{
    return address < FLASH_SIZE && p->conditional[address / 2];
}

/* The emulated core does not report skipped instructions. Therefore all instructions that an IT makes conditional are
 * counted together with the IT. */
static void count_conditional(emu_t *emu, emu_span_t *span, uint32_t address, uint32_t slots)
{
    for (uint32_t at = address; slots > 0 && at < FLASH_SIZE; slots--) {
        uint8_t code[2] = {0, 0};
        (void)uc_mem_read(emu->uc, at, code, sizeof code);
        emu->profile->conditional[at / 2U] = true;
        span->instructions++;
        span->cost += cost_of(emu, at);
        at += code[1] >= THUMB_32BIT ? 4U : 2U;
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
    if (is_conditional(p, address)) {
        return;
    }
    level->span.instructions++;
    level->span.cost += cost_of(emu, address);
    if (address < FLASH_SIZE) {
        count_conditional(emu, &level->span, address + size, emu->block[address / 2U].conditional);
    }
}

void profile_enter(emu_t *emu, int vector)
{
    profile_t *p = emu->profile;
    if (p->depth < NEST_MAX) {
        p->depth++;
    }
    p->level[p->depth] = (level_t){.span = {.vector = (uint32_t)vector}, .next = NOWHERE};
}

void profile_leave(emu_t *emu)
{
    profile_t *p = emu->profile;
    if (p->count < SPANS_MAX && p->depth > 0) {
        p->done[p->count++] = p->level[p->depth].span;
    }
    p->depth = p->depth > 0 ? p->depth - 1 : 0;
}
