/* SPDX-License-Identifier: Apache-2.0 */
#include "second_level/own_data.h"

#include "fx/codegen.h"

#define FIRST ((uint32_t)sizeof(uint32_t)) /* byte behind the checksum */
#define BYTES ((uint32_t)sizeof(second_level_constants_t) - FIRST)

_Static_assert(BYTES % SECOND_LEVEL_SLICE == 0U, "a pass consists of whole slices");
_Static_assert(SECOND_LEVEL_SLICE == sizeof(uint32_t), "a slice is a word");

/* Remainders of the sixteen half bytes by x^32 + x^26 + x^23 + ... + 1, reflected. */
static const uint32_t remainders[16] = {
    0x00000000U, 0x1DB71064U, 0x3B6E20C8U, 0x26D930ACU, 0x76DC4190U, 0x6B6B51F4U, 0x4DB26158U, 0x5005713CU,
    0xEDB88320U, 0xF00F9344U, 0xD6D6A3E8U, 0xCB61B38CU, 0x9B64C2B0U, 0x86D3D2D4U, 0xA00AE278U, 0xBDBDF21CU,
};

static uint32_t word_at(const uint8_t *bytes)
{
    return (uint32_t)bytes[0] | (uint32_t)bytes[1] << 8 | (uint32_t)bytes[2] << 16 | (uint32_t)bytes[3] << 24;
}

/* Four bytes at once, the first in the lowest bits. */
static uint32_t add_word(uint32_t sum, uint32_t word)
{
    uint32_t rest = sum ^ word;
    FX_UNROLLED
    for (uint32_t k = 0; k < 2U * SECOND_LEVEL_SLICE; k++) {
        rest = rest >> 4 ^ remainders[rest & 15U];
    }
    return rest;
}

bool second_level_own_data_step(const second_level_constants_t *constants, second_level_own_data_t *own)
{
    const uint8_t *bytes = (const uint8_t *)constants + FIRST;
    own->sum = ~add_word(~own->sum, word_at(&bytes[own->at]));
    own->at += SECOND_LEVEL_SLICE;
    if (own->at < BYTES) {
        return true;
    }
    const bool intact = own->sum == constants->checksum;
    *own = (second_level_own_data_t){0};
    return intact;
}
