/* SPDX-License-Identifier: Apache-2.0 */
#ifndef COMM_XCP_MEMORY_H
#define COMM_XCP_MEMORY_H
/** The memory areas that a master may read.
 * Source   docs/howto/xcp.md
 * Units    32-bit addresses; on a host they fit because the program is linked at a fixed address
 * Range    every address and size
 * Errors   NULL: the range does not lie inside one area
 * Context  1 kHz task */
#include <stddef.h>
#include <stdint.h>

typedef struct {
    const void *start;
    uint32_t size;
} xcp_area_t;

typedef struct {
    const xcp_area_t *area;
    uint8_t areas;
} xcp_memory_t;

static inline uint32_t xcp_address(const void *object)
{
    return (uint32_t)(uintptr_t)object;
}

/* The subtraction wraps for an address below the start: then it is larger than any size. */
static inline const uint8_t *xcp_memory_find(const xcp_memory_t *memory, uint32_t address, uint32_t size)
{
    for (uint8_t k = 0; k < memory->areas; k++) {
        const xcp_area_t *area = &memory->area[k];
        const uint32_t offset = address - xcp_address(area->start);
        if (offset < area->size && size <= area->size - offset) {
            // NOLINTNEXTLINE(clang-analyzer-core.NullPointerArithm): an area that is not empty has a start
            return (const uint8_t *)area->start + offset;
        }
    }
    return NULL;
}

#endif
