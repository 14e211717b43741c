/* SPDX-License-Identifier: Apache-2.0 */
#include "fx/lookup.h"

uint32_t fx_axis_position(int32_t offset, unsigned shift, uint32_t n)
{
    const uint32_t cells = (fx_arch_usat17(offset) << 14) >> shift;
    /* One count short of the last point, so that a cell always has a right-hand neighbour. */
    const uint32_t last = (n << 14) - 0x4001U;
    return (cells > last) ? last : cells;
}

bool fx_axis_valid(unsigned shift, uint32_t n)
{
    return (n - 2U <= 253U) && (shift <= 14U) && ((n - 1U) < (0x20000U >> shift));
}
