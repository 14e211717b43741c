/* SPDX-License-Identifier: Apache-2.0 */
/* Known checksums of CRC-32 (IEEE 802.3). All bytes from 0 to 255 need every entry of the table in both halves. */
#include "signal/crc32.h"

#include "unity.h"

void setUp(void)
{
}

void tearDown(void)
{
}

void test_the_check_value_of_the_standard(void)
{
    TEST_ASSERT_EQUAL_HEX32(0xCBF43926U, ~crc32_update(CRC32_START, "123456789", 9));
}

void test_all_bytes_have_the_known_checksum_also_in_two_parts(void)
{
    uint8_t bytes[256];
    for (unsigned k = 0; k < sizeof bytes; k++) {
        bytes[k] = (uint8_t)k;
    }
    TEST_ASSERT_EQUAL_HEX32(0x29058C73U, ~crc32_update(CRC32_START, bytes, sizeof bytes));
    const uint32_t half = crc32_update(CRC32_START, bytes, 100);
    TEST_ASSERT_EQUAL_HEX32(0x29058C73U, ~crc32_update(half, &bytes[100], sizeof bytes - 100U));
}
