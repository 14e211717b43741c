/* SPDX-License-Identifier: Apache-2.0 */
#include "signal/crc32.h"

/* CRC of each of the sixteen half bytes. */
static const uint32_t half_byte_table[16] = {
    0x00000000U, 0x1DB71064U, 0x3B6E20C8U, 0x26D930ACU, 0x76DC4190U, 0x6B6B51F4U, 0x4DB26158U, 0x5005713CU,
    0xEDB88320U, 0xF00F9344U, 0xD6D6A3E8U, 0xCB61B38CU, 0x9B64C2B0U, 0x86D3D2D4U, 0xA00AE278U, 0xBDBDF21CU,
};

uint32_t crc32_update(uint32_t crc, const void *data, uint32_t size)
{
    const uint8_t *byte = data;
    for (uint32_t k = 0; k < size; k++) {
        crc ^= byte[k];
        crc = half_byte_table[crc & 15U] ^ (crc >> 4);
        crc = half_byte_table[crc & 15U] ^ (crc >> 4);
    }
    return crc;
}
