/* SPDX-License-Identifier: Apache-2.0 */
#include "hal/s32k144/image.h"

#include <stdint.h>

#include "signal/crc32.h"

/* Bytes in a call. The background loop does other work after each slice, which takes as long as some 400 bytes: larger
 * slices make a pass shorter, smaller ones let a request to save wait less. */
#define SLICE 2048U
#define SEALED(name) \
    extern const uint8_t name##_start[], name##_end[]; /* from the linker script */ \
    __attribute__((section(".protected_crc"), used)) const volatile uint32_t name##_crc = 0xFFFFFFFFU

SEALED(protected);
SEALED(hot);
SEALED(vectors);
SEALED(program);

typedef struct {
    const uint8_t *start, *end;
    const volatile uint32_t *crc;
} area_t;

#define AREA(name) {name##_start, name##_end, &name##_crc}
#define AREAS 4U
#define AREAS_AT_START 2U /* the others take too long */

static const area_t areas[AREAS] = {AREA(protected), AREA(hot), AREA(vectors), AREA(program)};

/* Background only: where the pass over all areas stands. */
static uint32_t area;
static uint32_t checked; /* bytes of that area */
static uint32_t running = CRC32_START;

bool image_step(void)
{
    const area_t *now = &areas[area];
    const uint32_t left = (uint32_t)(now->end - now->start) - checked;
    const uint32_t size = (left < SLICE) ? left : SLICE;
    running = crc32_update(running, &now->start[checked], size);
    checked += size;
    if (size < left) {
        return true;
    }
    const bool good = ~running == *now->crc;
    area = (area + 1U) % AREAS;
    checked = 0;
    running = CRC32_START;
    return good;
}

bool image_valid(void)
{
    bool good = true;
    do {
        good = image_step() && good;
    } while (area < AREAS_AT_START);
    return good;
}
