/* SPDX-License-Identifier: Apache-2.0 */
#include "signal/seal.h"

#include "fx/codegen.h"

/* A word of the sealed data, whose members may have any type. */
typedef uint32_t FX_ANY_OBJECT sealed_word_t;

uint32_t seal_of(const void *data, uint32_t size)
{
    const sealed_word_t *word = data;
    const void *const end = (const uint8_t *)data + size;
    uint32_t seal = SEAL_START;
    while ((const void *)word != end) {
        seal = seal_add(seal, *word);
        word++;
    }
    return seal;
}
