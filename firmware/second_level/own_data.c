/* SPDX-License-Identifier: Apache-2.0 */
#include "second_level/own_data.h"

#define FIRST ((uint32_t)sizeof(uint32_t)) /* byte behind the checksum */
#define BYTES ((uint32_t)sizeof(second_level_constants_t) - FIRST)

_Static_assert(BYTES % SECOND_LEVEL_SLICE == 0U, "a pass consists of whole slices");

/* Remainders of the sixteen half bytes by x^32 + x^26 + x^23 + ... + 1, reflected. */
static const uint32_t remainders[16] = {
    0x00000000U, 0x1DB71064U, 0x3B6E20C8U, 0x26D930ACU, 0x76DC4190U, 0x6B6B51F4U, 0x4DB26158U, 0x5005713CU,
    0xEDB88320U, 0xF00F9344U, 0xD6D6A3E8U, 0xCB61B38CU, 0x9B64C2B0U, 0x86D3D2D4U, 0xA00AE278U, 0xBDBDF21CU,
};

static uint32_t add_byte(uint32_t sum, uint32_t byte)
{
    const uint32_t lower = (sum ^ byte) >> 4 ^ remainders[(sum ^ byte) & 15U];
    return lower >> 4 ^ remainders[lower & 15U];
}

bool second_level_own_data_step(const second_level_constants_t *constants, second_level_own_data_t *own)
{
    const uint8_t *bytes = (const uint8_t *)constants + FIRST;
    uint32_t sum = ~own->sum;
    for (uint32_t k = own->at; k < own->at + SECOND_LEVEL_SLICE; k++) {
        sum = add_byte(sum, bytes[k]);
    }
    own->sum = ~sum;
    own->at += SECOND_LEVEL_SLICE;
    if (own->at < BYTES) {
        return true;
    }
    const bool intact = own->sum == constants->checksum;
    *own = (second_level_own_data_t){0};
    return intact;
}
