/* SPDX-License-Identifier: Apache-2.0 */
#include "hal/s32k144/image.h"

#include <stdint.h>

#include "signal/crc32.h"

#define SLICE 64U

/* From the linker script. */
extern const uint8_t protected_start[], protected_end[];

__attribute__((section(".protected_crc"), used)) const volatile uint32_t protected_crc = 0xFFFFFFFFU;

/* Background only. */
static const uint8_t *at = protected_start;
static uint32_t running = CRC32_START;

bool image_step(void)
{
    const uint32_t left = (uint32_t)(protected_end - at);
    const uint32_t now = (left < SLICE) ? left : SLICE;
    running = crc32_update(running, at, now);
    at += now;
    if (at < protected_end) {
        return true;
    }
    const bool good = ~running == protected_crc;
    at = protected_start;
    running = CRC32_START;
    return good;
}

bool image_valid(void)
{
    bool good = image_step();
    while (at != protected_start) {
        good = image_step();
    }
    return good;
}
