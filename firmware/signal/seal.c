/* SPDX-License-Identifier: Apache-2.0 */
#include "signal/seal.h"

#include "fx/codegen.h"

/* A word of the sealed data, whose members may have any type. */
typedef uint32_t FX_ANY_OBJECT sealed_word_t;

uint32_t seal_of(const void *data, uint32_t size)
{
    const sealed_word_t *word = data;
    uint32_t seal = SEAL_START;
    for (uint32_t k = 0; k < size / sizeof *word; k++) {
        seal = seal_add(seal, word[k]);
    }
    return seal;
}
