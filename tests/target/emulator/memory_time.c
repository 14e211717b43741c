/* SPDX-License-Identifier: Apache-2.0 */
#include "memory_time.h"

#include <stdlib.h>

enum { FLASH_END = 0x80000, DATA_FLASH = 0x10000000, SRAM_L = 0x1C000000, SRAM_U = 0x20000000, BRIDGES = 0x40000000 };
enum { WAYS_MAX = 4, SETS_MAX = 1024, NO_LINE = -1 };
#define PRIVATE_BUS 0xE0000000U

struct memory_time {
    memory_costs_t costs;
    int64_t ahead;                    /* the line that the flash has read ahead */
    int64_t line[SETS_MAX][WAYS_MAX]; /* the most recently used one first */
};

static bool power_of_two(uint32_t x)
{
    return x != 0U && (x & (x - 1U)) == 0U;
}

memory_time_t *memory_time_create(const memory_costs_t *costs)
{
    if (!power_of_two(costs->sets) || costs->sets > SETS_MAX || costs->ways == 0U || costs->ways > WAYS_MAX ||
        !power_of_two(costs->line_bytes)) {
        return NULL;
    }
    memory_time_t *memory = calloc(1, sizeof *memory);
    if (memory == NULL) {
        return NULL;
    }
    memory->costs = *costs;
    memory->ahead = NO_LINE;
    for (uint32_t set = 0; set < SETS_MAX; set++) {
        for (uint32_t way = 0; way < WAYS_MAX; way++) {
            memory->line[set][way] = NO_LINE;
        }
    }
    return memory;
}

void memory_time_destroy(memory_time_t *memory)
{
    free(memory);
}

/* Makes the line the most recently used one of its set; false: it was not there, and has replaced the last one. */
static bool touch(memory_time_t *memory, int64_t line)
{
    int64_t *way = memory->line[(uint64_t)line & (memory->costs.sets - 1U)];
    uint32_t at = 0;
    while (at < memory->costs.ways - 1U && way[at] != line) {
        at++;
    }
    const bool found = way[at] == line;
    for (; at > 0; at--) {
        way[at] = way[at - 1U];
    }
    way[0] = line;
    return found;
}

static uint32_t from_flash(memory_time_t *memory, uint32_t first, uint32_t last)
{
    uint32_t waited = 0;
    for (int64_t line = first / memory->costs.line_bytes; line <= last / memory->costs.line_bytes; line++) {
        if (!touch(memory, line)) {
            waited += line == memory->ahead ? memory->costs.fill_ahead : memory->costs.fill;
            memory->ahead = line + 1;
        }
    }
    return waited;
}

uint32_t memory_time_fetch(memory_time_t *memory, uint32_t address, uint32_t size)
{
    if (address >= FLASH_END) {
        return 0; /* the only other memory for instructions is SRAM_L, on the same bus and without wait states */
    }
    return from_flash(memory, address, address + size + memory->costs.fetch_ahead_bytes - 1U);
}

uint32_t memory_time_access(memory_time_t *memory, uint32_t address, uint32_t size, bool store)
{
    const memory_costs_t *costs = &memory->costs;
    const uint32_t narrow = store && size < 4U ? costs->narrow_store : 0U;
    if (address < FLASH_END) {
        return costs->code_bus + from_flash(memory, address, address + size - 1U);
    }
    if (address >= DATA_FLASH && address < SRAM_L) {
        return costs->code_bus + costs->fill; /* not cached */
    }
    if (address >= SRAM_L && address < SRAM_U) {
        return costs->code_bus + narrow;
    }
    if (address >= SRAM_U && address < BRIDGES) {
        return narrow;
    }
    return address >= BRIDGES && address < PRIVATE_BUS ? costs->peripheral : 0U;
}

static bool on_code_bus(uint32_t address)
{
    return address < SRAM_U;
}

uint32_t memory_time_return(const memory_time_t *memory, uint32_t stack, uint32_t words)
{
    return on_code_bus(stack) ? words * memory->costs.code_bus : 0U;
}

uint32_t memory_time_entry(memory_time_t *memory, uint32_t vector_address, uint32_t stack, uint32_t words)
{
    const uint32_t waited = memory_time_access(memory, vector_address, 4, false) +
                            memory_time_return(memory, stack, words);
    return waited > memory->costs.hidden_at_entry ? waited - memory->costs.hidden_at_entry : 0U;
}
