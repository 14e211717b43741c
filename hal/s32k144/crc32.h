/* SPDX-License-Identifier: Apache-2.0 */
#ifndef HAL_S32K144_CRC32_H
#define HAL_S32K144_CRC32_H
/** CRC-32 of IEEE 802.3 (reflected, 0xEDB88320), four bits at a time.
 * Source   IEEE 802.3, 3.2.9
 * Range    start with CRC32_START, end with crc32_end()
 * Context  any; 2 steps a byte */
#include <stdint.h>

#define CRC32_START 0xFFFFFFFFU

static inline uint32_t crc32_step(uint32_t crc, uint8_t byte)
{
    static const uint32_t nibble[16] = {
        0x00000000U, 0x1DB71064U, 0x3B6E20C8U, 0x26D930ACU, 0x76DC4190U, 0x6B6B51F4U, 0x4DB26158U, 0x5005713CU,
        0xEDB88320U, 0xF00F9344U, 0xD6D6A3E8U, 0xCB61B38CU, 0x9B64C2B0U, 0x86D3D2D4U, 0xA00AE278U, 0xBDBDF21CU};
    crc ^= byte;
    crc = (crc >> 4) ^ nibble[crc & 15U];
    return (crc >> 4) ^ nibble[crc & 15U];
}

static inline uint32_t crc32_end(uint32_t crc)
{
    return ~crc;
}

#endif
