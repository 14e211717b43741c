/* SPDX-License-Identifier: Apache-2.0 */
#ifndef HAL_S32K144_IMAGE_H
#define HAL_S32K144_IMAGE_H
/** The checksums over the motor's configuration and tables, over the code in the RAM, over the vectors, and over code
 * with constants in the flash.
 *   CRC-32 of IEEE 802.3 from protected_start to protected_end, hot_start to hot_end, vectors_start to vectors_end,
 *   program_start to program_end; protected_crc, hot_crc, vectors_crc and program_crc are written after linking by
 *   `tools/fluxtrue target seal`, and an image that was never sealed does not match
 * Source   README.md, memory
 * Context  image_valid(): start-up, the data and the code in the RAM only, because the rest takes too long there;
 *          image_step(): background, the next slice of the pass over all four, false when it ends an area that does
 *          not match */
#include <stdbool.h>

bool image_valid(void);
bool image_step(void);

#endif
