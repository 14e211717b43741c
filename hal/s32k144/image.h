/* SPDX-License-Identifier: Apache-2.0 */
#ifndef HAL_S32K144_IMAGE_H
#define HAL_S32K144_IMAGE_H
/** The checksums over the flash: the motor's configuration and tables, the vectors, code with constants.
 *   CRC-32 of IEEE 802.3 from protected_start to protected_end, vectors_start to vectors_end, program_start to
 *   program_end; protected_crc, vectors_crc and program_crc are written after linking by `tools/fluxtrue target seal`,
 *   and an image that was never sealed does not match
 * Source   README.md, memory
 * Context  image_valid(): start-up, the data only, because code takes too long there; image_step(): background, the
 *          next slice of the pass over all three, false when it ends an area that does not match */
#include <stdbool.h>

bool image_valid(void);
bool image_step(void);

#endif
