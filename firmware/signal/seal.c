/* SPDX-License-Identifier: Apache-2.0 */
#include "signal/seal.h"

uint32_t seal_of(const void *data, uint32_t size)
{
    const uint32_t *word = data;
    uint32_t seal = SEAL_START;
    for (uint32_t k = 0; k < size / sizeof *word; k++) {
        seal = seal_add(seal, word[k]);
    }
    return seal;
}
