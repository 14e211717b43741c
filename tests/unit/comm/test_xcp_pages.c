/* SPDX-License-Identifier: Apache-2.0 */
/* Pages of calibration values: bytes that wait for the rest of their value, and which page is read, written and used.
 * The values are 1, 2 and 3; allowed are 0 to 10, 2 to 4 and -1 to 5. */
#include <string.h>

#include "unity.h"
#include "xcp_master.h"

void setUp(void)
{
    master_reset();
    master_connect();
}

void tearDown(void)
{
}

/* Downloads `count` bytes of a value from byte `from` on. */
static void part(int parameter, float value, uint32_t from, uint8_t count)
{
    uint8_t bytes[4];
    memcpy(bytes, &value, 4);
    master_download(xcp_address(&working[parameter]) + from, &bytes[from], count);
}

static void whole(int parameter, float value)
{
    part(parameter, value, 0, 4);
}

void test_after_connect_stored_or_refused_values_a_part_of_the_next_one_changes_nothing(void)
{
    master_unlock();
    part(0, 5.0F, 1, 3);
    EXPECT_WHOLE(0xFF);
    TEST_ASSERT_EQUAL_FLOAT(1.0F, working[0]);
    whole(0, 4.0F);
    part(0, 5.0F, 1, 3);
    TEST_ASSERT_EQUAL_FLOAT(4.0F, working[0]);
    whole(0, 99.0F);
    EXPECT_ERROR(0x22);
    part(0, 5.0F, 1, 3);
    EXPECT_WHOLE(0xFF);
    TEST_ASSERT_EQUAL_FLOAT(4.0F, working[0]);
}

void test_a_refused_value_discards_its_own_bytes_only(void)
{
    for (int waits = 0; waits < 3; waits++) {
        for (int refused = 0; refused < 3; refused++) {
            if (refused != waits) {
                setUp();
                master_unlock();
                part(waits, 2.5F, 0, 2);
                whole(refused, 99.0F);
                EXPECT_ERROR(0x22);
                part(waits, 2.5F, 2, 2);
                EXPECT_WHOLE(0xFF);
                TEST_ASSERT_EQUAL_FLOAT(2.5F, working[waits]);
            }
        }
    }
}

void test_a_command_that_completes_two_values_stores_both(void)
{
    const float block[2] = {3.5F, 4.5F};
    const uint8_t *bytes = (const uint8_t *)block;
    master_unlock();
    master_download(xcp_address(&working[1]), bytes, 2);
    master_download(xcp_address(&working[1]) + 2, &bytes[2], 6);
    EXPECT_WHOLE(0xFF);
    TEST_ASSERT_EQUAL_MEMORY(block, &working[1], sizeof block);
    TEST_ASSERT_EQUAL_UINT32(2, slave.generation);
}

void test_the_master_reads_the_page_that_it_has_selected(void)
{
    master_unlock();
    whole(1, 4.0F);
    SEND(0xF4, 4, 0, 0, AT(&working[1]));
    EXPECT_WHOLE(0xFF, 0x00, 0x00, 0x80, 0x40); /* 4.0 */
    SEND(0xEB, 0x02, 0, 0);
    SEND(0xF4, 4, 0, 0, AT(&working[1]));
    EXPECT_WHOLE(0xFF, 0x00, 0x00, 0x00, 0x40); /* 2.0 */
}

void test_the_master_selects_its_own_page_without_the_key_and_the_drives_stays(void)
{
    SEND(0xEB, 0x02, 0, 0);
    EXPECT_WHOLE(0xFF);
    SEND(0xEA, 1, 0);
    EXPECT_WHOLE(0xFF, 0, 0, 1);
    SEND(0xEA, 2, 0);
    EXPECT_WHOLE(0xFF, 0, 0, 0);
    TEST_ASSERT_EQUAL_UINT32(0, slave.generation);
}

/* The generation tells the drive that its values have changed. */
void test_only_a_change_of_what_the_drive_uses_is_a_new_generation(void)
{
    master_unlock();
    SEND(0xEB, 0x01, 0, 1); /* as it was */
    TEST_ASSERT_EQUAL_UINT32(0, slave.generation);
    SEND(0xEB, 0x01, 0, 0);
    TEST_ASSERT_EQUAL_UINT32(1, slave.generation);
    whole(0, 5.0F); /* on the page that the drive does not use */
    EXPECT_WHOLE(0xFF);
    TEST_ASSERT_EQUAL_FLOAT(5.0F, working[0]);
    TEST_ASSERT_EQUAL_UINT32(1, slave.generation);
    SEND(0xE4, 0, 0, 0, 1);
    TEST_ASSERT_EQUAL_UINT32(2, slave.generation);
}

void test_copying_the_page_needs_the_key(void)
{
    working[0] = 7.0F;
    SEND(0xE4, 0, 0, 0, 1);
    EXPECT_ERROR(0x25);
    TEST_ASSERT_EQUAL_FLOAT(7.0F, working[0]);
}

void test_copying_the_page_discards_waiting_bytes(void)
{
    master_unlock();
    part(0, 5.0F, 0, 2);
    SEND(0xE4, 0, 0, 0, 1);
    EXPECT_WHOLE(0xFF);
    part(0, 5.0F, 2, 2);
    TEST_ASSERT_EQUAL_FLOAT(1.0F, working[0]);
}
