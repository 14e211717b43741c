/* SPDX-License-Identifier: Apache-2.0 */
#include "hal/s32k144/image.h"

#include <stdint.h>

#include "signal/crc32.h"

#define SLICE 64U
#define SEALED(name) \
    extern const uint8_t name##_start[], name##_end[]; /* from the linker script */ \
    __attribute__((section(".protected_crc"), used)) const volatile uint32_t name##_crc = 0xFFFFFFFFU

SEALED(protected);
SEALED(vectors);
SEALED(program);

typedef struct {
    const uint8_t *start, *end;
    const volatile uint32_t *crc;
    const uint8_t *at;
    uint32_t running;
} area_t;

#define AREA(name) {name##_start, name##_end, &name##_crc, name##_start, CRC32_START}

/* Background only. */
static area_t data = AREA(protected);
static area_t vectors = AREA(vectors);
static area_t program = AREA(program);

/* False once the end is reached and the whole does not match. */
static bool area_step(area_t *area)
{
    const uint32_t left = (uint32_t)(area->end - area->at);
    const uint32_t now = (left < SLICE) ? left : SLICE;
    area->running = crc32_update(area->running, area->at, now);
    area->at += now;
    if (area->at < area->end) {
        return true;
    }
    const bool good = ~area->running == *area->crc;
    area->at = area->start;
    area->running = CRC32_START;
    return good;
}

bool image_step(void)
{
    const bool good_data = area_step(&data);
    const bool good_vectors = area_step(&vectors);
    const bool good_program = area_step(&program);
    return good_data && good_vectors && good_program;
}

bool image_valid(void)
{
    bool good = area_step(&data);
    while (data.at != data.start) {
        good = area_step(&data);
    }
    return good;
}
