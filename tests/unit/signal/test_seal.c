/* SPDX-License-Identifier: Apache-2.0 */
#include "signal/seal.h"
#include "unity.h"

#define WORDS 35U

static uint32_t data[WORDS];

void setUp(void)
{
    for (uint32_t n = 0; n < WORDS; n++) {
        data[n] = n * 2654435761U;
    }
}

void tearDown(void)
{
}

/* By hand: all ones, rotated, against the word. */
void test_the_seal_is_the_rotated_sum_of_the_words(void)
{
    const uint32_t words[] = {0x00000001U, 0x80000000U};
    TEST_ASSERT_EQUAL_HEX32(0xFFFFFFFEU, seal_of(words, sizeof words[0]));
    TEST_ASSERT_EQUAL_HEX32(0xFFFFFFFFU, seal_of(words, sizeof words));
    TEST_ASSERT_EQUAL_HEX32(0xFFFFFFFFU, seal_of(words, 0));
}

void test_every_flipped_bit_breaks_the_seal(void)
{
    const uint32_t seal = seal_of(data, sizeof data);
    for (uint32_t bit = 0; bit < 32U * WORDS; bit++) {
        data[bit / 32U] ^= 1U << bit % 32U;
        TEST_ASSERT_NOT_EQUAL_HEX32(seal, seal_of(data, sizeof data));
        data[bit / 32U] ^= 1U << bit % 32U;
    }
    TEST_ASSERT_EQUAL_HEX32(seal, seal_of(data, sizeof data));
}

/* A plain sum modulo two would miss these. */
void test_the_same_bit_in_two_neighbours_breaks_the_seal(void)
{
    const uint32_t seal = seal_of(data, sizeof data);
    for (uint32_t bit = 0; bit < 32U; bit++) {
        data[7] ^= 1U << bit;
        data[8] ^= 1U << bit;
        TEST_ASSERT_NOT_EQUAL_HEX32(seal, seal_of(data, sizeof data));
        setUp();
    }
}
