/* SPDX-License-Identifier: Apache-2.0 */
/* The second level's constants as they are generated, and with each single flipped bit. */
#include "drive/motor.h"
#include "second_level/own_data.h"
#include "unity.h"

#define PASS ((int)((sizeof(second_level_constants_t) - sizeof(uint32_t)) / SECOND_LEVEL_SLICE))

static second_level_constants_t constants;
static second_level_own_data_t own;

void setUp(void)
{
    constants = *motor.second_level;
    own = (second_level_own_data_t){0};
}

void tearDown(void)
{
}

/* The step in which damage is reported; 0: none of them. */
static int reported_in(int steps)
{
    for (int n = 1; n <= steps; n++) {
        if (!second_level_own_data_step(&constants, &own)) {
            return n;
        }
    }
    return 0;
}

void test_the_generated_constants_match_their_checksum_in_every_pass(void)
{
    TEST_ASSERT_EQUAL_INT(0, reported_in(5 * PASS));
}

void test_every_flipped_bit_is_found_in_a_pass(void)
{
    uint8_t *bytes = (uint8_t *)&constants;
    for (uint32_t bit = 0; bit < 8U * (uint32_t)sizeof constants; bit++) {
        bytes[bit / 8U] ^= (uint8_t)(1U << (bit % 8U));
        TEST_ASSERT_EQUAL_INT(PASS, reported_in(PASS));
        bytes[bit / 8U] ^= (uint8_t)(1U << (bit % 8U));
        TEST_ASSERT_EQUAL_INT(0, reported_in(PASS));
    }
}

/* At its worst place, the byte that was just read. */
void test_a_bit_that_flips_while_driving_is_found_within_two_passes(void)
{
    for (int at = 0; at < PASS; at++) {
        setUp();
        TEST_ASSERT_EQUAL_INT(0, reported_in(at + 1));
        constants.torque_per_count ^= 1;
        const int found = reported_in(2 * PASS);
        TEST_ASSERT_GREATER_THAN_INT(0, found);
        TEST_ASSERT_LESS_THAN_INT(2 * PASS, found);
    }
}
