/* SPDX-License-Identifier: Apache-2.0 */
#ifndef HAL_S32K144_REFERENCE_H
#define HAL_S32K144_REFERENCE_H
/** The converters' reference, 5 V, from a 12-bit count of the processor's bandgap, 1 V: 1000 count/819.2.
 * Source   README.md, reference of the converters: the voltage is a sister chip's
 * Units    thousandths of the count that the nominal reference gives
 * Range    0 ... 4095 counts: 0 ... 4998
 * Rounding 1/2
 * Errors   none
 * Context  1 kHz task */
#include <stdint.h>

#define PERMILLE_PER_COUNT_Q16 80000U /* 1000/819.2 */

static inline int16_t reference_permille(uint16_t count)
{
    return (int16_t)((count * PERMILLE_PER_COUNT_Q16 + 0x8000U) >> 16);
}

#endif
