/* SPDX-License-Identifier: Apache-2.0 */
#ifndef HAL_S32K144_IMAGE_H
#define HAL_S32K144_IMAGE_H
/** The checksum over the motor's configuration and tables in flash.
 *   CRC-32 of IEEE 802.3 from protected_start to protected_end; the word behind it is written after linking by
 *   `tools/fluxtrue target seal`, and an image that was never sealed does not match
 * Source   README.md, memory
 * Context  image_valid(): start-up; image_step(): background, a slice per call, false once the whole does not match */
#include <stdbool.h>

bool image_valid(void);
bool image_step(void);

#endif
