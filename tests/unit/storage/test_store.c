/* SPDX-License-Identifier: Apache-2.0 */
#include <string.h>

#include "signal/crc32.h"
#include "storage/store.h"
#include "unity.h"

#define LAYOUT 0x46540001U
#define NEVER INT32_MAX

/* A simulated flash. Writing can only clear bits; the power fails when `energy` bytes have been written or erased. */
static uint8_t memory[HAL_NVM_SLOTS][HAL_NVM_SLOT_SIZE];
static int32_t energy;
static bool erase_fails, program_fails;
static int programs; /* calls */
static uint32_t failed_sectors;
static int stuck_offset;        /* this byte of every slot is stored with one wrong bit; -1: none */
static int reads, failing_read; /* the read with this number reports a failure, although the data are right; -1: none */
static bool reads_blank;        /* it returns blank flash instead, and reports nothing */

typedef struct {
    uint32_t number;
    uint8_t body[173]; /* neither a whole number of flash units nor of chunks of the store */
} record_t;

static record_t record_of(uint32_t number)
{
    record_t r = {.number = number};
    for (uint32_t k = 0; k < sizeof r.body; k++) {
        r.body[k] = (uint8_t)(number * 31U + k * 7U);
    }
    return r;
}

bool hal_nvm_read(uint32_t slot, uint32_t offset, void *data, uint32_t size)
{
    TEST_ASSERT_TRUE(slot < HAL_NVM_SLOTS && offset + size <= HAL_NVM_SLOT_SIZE);
    memcpy(data, &memory[slot][offset], size);
    if (reads++ != failing_read) {
        return true;
    }
    if (reads_blank) {
        memset(data, 0xFF, size);
    }
    return reads_blank;
}

bool hal_nvm_erase(uint32_t slot)
{
    /* After an interrupted erase only a part is erased. */
    for (uint32_t k = 0; k < HAL_NVM_SLOT_SIZE && !erase_fails; k++) {
        if (energy <= 0) {
            return false;
        }
        energy--;
        memory[slot][k] = 0xFF;
    }
    return !erase_fails;
}

bool hal_nvm_program(uint32_t slot, uint32_t offset, const void *data, uint32_t size)
{
    const uint8_t *byte = data;
    programs++;
    if (program_fails) {
        return false;
    }
    TEST_ASSERT_TRUE(offset % HAL_NVM_UNIT == 0 && size % HAL_NVM_UNIT == 0 && offset + size <= HAL_NVM_SLOT_SIZE);
    for (uint32_t k = 0; k < size; k++) {
        if (energy <= 0) {
            return false;
        }
        energy--;
        memory[slot][offset + k] &= byte[k];
        if ((int)(offset + k) == stuck_offset) {
            memory[slot][offset + k] ^= 0x10;
        }
    }
    return true;
}

void setUp(void)
{
    memset(memory, 0xFF, sizeof memory);
    energy = NEVER;
    erase_fails = program_fails = false;
    programs = 0;
    failed_sectors = 0;
    stuck_offset = failing_read = -1;
    reads = 0;
    reads_blank = false;
}

void tearDown(void)
{
}

static bool save(uint32_t number)
{
    const record_t r = record_of(number);
    return store_save(LAYOUT, &r, sizeof r, &failed_sectors);
}

/* The number of the record that loads; fails unless every byte belongs to it. */
static uint32_t loaded(void)
{
    record_t r;
    TEST_ASSERT_EQUAL(STORE_OK, store_load(LAYOUT, &r, sizeof r));
    const record_t whole = record_of(r.number);
    TEST_ASSERT_EQUAL_MEMORY(&whole, &r, sizeof r);
    return r.number;
}

void test_the_check_value_of_the_crc_is_the_published_one(void)
{
    TEST_ASSERT_EQUAL_HEX32(0xCBF43926, crc32("123456789", 9));
    TEST_ASSERT_EQUAL_HEX32(0xCBF43926, ~crc32_update(crc32_update(CRC32_START, "1234", 4), "56789", 5));
}

void test_an_erased_memory_is_empty_and_does_not_change_the_record(void)
{
    record_t r = record_of(9);
    const record_t before = r;
    TEST_ASSERT_EQUAL(STORE_EMPTY, store_load(LAYOUT, &r, sizeof r));
    TEST_ASSERT_EQUAL_MEMORY(&before, &r, sizeof r);
}

void test_the_newest_of_many_saves_is_loaded_and_the_slots_alternate(void)
{
    for (uint32_t number = 1; number <= 10; number++) {
        TEST_ASSERT_TRUE(save(number));
        TEST_ASSERT_EQUAL_UINT32(number, loaded());
    }
    memset(memory[1], 0xFF, sizeof memory[1]); /* erase the slot of the tenth */
    TEST_ASSERT_EQUAL_UINT32(9, loaded());
}

void test_the_sequence_may_wrap(void)
{
    TEST_ASSERT_TRUE(save(1));
    uint32_t header[4];
    memcpy(header, memory[0], sizeof header);
    header[2] = UINT32_MAX;
    const record_t r = record_of(1);
    header[3] = ~crc32_update(crc32_update(CRC32_START, header, 12), &r, sizeof r);
    memcpy(memory[0], header, sizeof header);
    TEST_ASSERT_TRUE(save(2));
    TEST_ASSERT_EQUAL_UINT32(2, loaded());
}

void test_a_cut_at_any_byte_of_a_save_leaves_the_old_or_the_new_record(void)
{
    const int32_t whole = (int32_t)(HAL_NVM_SLOT_SIZE + STORE_HEADER_SIZE + (sizeof(record_t) + 7U) / 8U * 8U);
    for (int32_t cut = 0; cut <= whole; cut++) {
        setUp();
        TEST_ASSERT_TRUE(save(1) && save(2));
        energy = cut;
        const bool done = save(3);
        TEST_ASSERT_EQUAL(cut == whole, done);
        TEST_ASSERT_EQUAL_UINT32(done ? 3 : 2, loaded());
        energy = NEVER; /* the next save works on the interrupted one */
        TEST_ASSERT_TRUE(save(4));
        TEST_ASSERT_EQUAL_UINT32(4, loaded());
    }
}

void test_a_cut_during_the_very_first_save_loads_nothing(void)
{
    energy = (int32_t)HAL_NVM_SLOT_SIZE + 100;
    record_t r;
    TEST_ASSERT_FALSE(save(1));
    TEST_ASSERT_NOT_EQUAL(STORE_OK, store_load(LAYOUT, &r, sizeof r));
}

void test_any_flipped_bit_of_the_newest_record_gives_the_one_before(void)
{
    TEST_ASSERT_TRUE(save(1) && save(2));
    for (uint32_t bit = 0; bit < 8U * (STORE_HEADER_SIZE + (uint32_t)sizeof(record_t)); bit++) {
        memory[1][bit / 8U] ^= (uint8_t)(1U << (bit % 8U));
        TEST_ASSERT_EQUAL_UINT32(1, loaded());
        memory[1][bit / 8U] ^= (uint8_t)(1U << (bit % 8U));
    }
}

/* The headers of both slots, that of the newest again, and its record in chunks to check it. */
void test_a_read_that_fails_or_returns_blank_flash_gives_the_record_before(void)
{
    TEST_ASSERT_TRUE(save(1));
    TEST_ASSERT_TRUE(save(2));
    reads = 0;
    TEST_ASSERT_EQUAL_UINT32(2, loaded());
    const int last = reads - 1; /* of the checked record to the caller */
    for (int n = 0; n < 2 * last; n++) {
        failing_read = n / 2;
        reads_blank = n % 2 != 0;
        reads = 0;
        TEST_ASSERT_EQUAL_UINT32((failing_read == 0) ? 2 : 1, loaded());
    }
}

void test_a_memory_that_cannot_be_read_is_reported_as_damaged_and_a_blank_one_as_empty(void)
{
    record_t r;
    failing_read = 0;
    TEST_ASSERT_EQUAL(STORE_DAMAGED, store_load(LAYOUT, &r, sizeof r));
    setUp();
    TEST_ASSERT_EQUAL(STORE_EMPTY, store_load(LAYOUT, &r, sizeof r));
}

/* Each word in turn; the size of the others is that of blank flash, and this one's is too large, too. */
void test_a_header_with_one_word_that_is_not_blank_is_reported_as_damaged(void)
{
    record_t r;
    for (unsigned word = 0; word < STORE_HEADER_SIZE / sizeof(uint32_t); word++) {
        setUp();
        memory[0][word * sizeof(uint32_t)] = 0x7F;
        TEST_ASSERT_EQUAL(STORE_DAMAGED, store_load(LAYOUT, &r, sizeof r));
    }
}

void test_two_damaged_slots_are_reported_and_not_used(void)
{
    TEST_ASSERT_TRUE(save(1) && save(2));
    memory[0][40] ^= 1;
    memory[1][40] ^= 1;
    record_t r = record_of(9);
    TEST_ASSERT_EQUAL(STORE_DAMAGED, store_load(LAYOUT, &r, sizeof r));
    TEST_ASSERT_EQUAL_UINT32(9, r.number);
}

void test_another_layout_or_size_is_not_found(void)
{
    record_t r;
    TEST_ASSERT_TRUE(save(1));
    TEST_ASSERT_EQUAL(STORE_EMPTY, store_load(LAYOUT + 1U, &r, sizeof r));
    TEST_ASSERT_EQUAL(STORE_EMPTY, store_load(LAYOUT, &r, sizeof r - 1U));
}

void test_a_memory_that_stores_wrong_data_is_detected(void)
{
    TEST_ASSERT_TRUE(save(1));
    stuck_offset = 60;
    TEST_ASSERT_FALSE(save(2));
    TEST_ASSERT_EQUAL_UINT32(1, loaded());
    stuck_offset = -1;
    erase_fails = true;
    TEST_ASSERT_FALSE(save(3));
    TEST_ASSERT_EQUAL_UINT32(1, loaded());
    TEST_ASSERT_EQUAL_UINT32(2, failed_sectors);
}

void test_a_record_larger_than_a_slot_is_refused_before_anything_is_erased(void)
{
    static uint8_t large[HAL_NVM_SLOT_SIZE];
    TEST_ASSERT_TRUE(save(1) && save(2));
    TEST_ASSERT_FALSE(store_save(LAYOUT, large, STORE_RECORD_MAX + 1U, &failed_sectors));
    memory[1][40] ^= 1;
    TEST_ASSERT_EQUAL_UINT32(1, loaded());
}

void test_records_of_every_length_are_stored_whole(void)
{
    uint8_t bytes[200], back[200];
    for (uint32_t k = 0; k < sizeof bytes; k++) {
        bytes[k] = (uint8_t)(k * 7U);
    }
    for (uint32_t size = 1; size <= sizeof bytes; size++) {
        TEST_ASSERT_TRUE(store_save(LAYOUT, bytes, size, &failed_sectors));
        memset(back, 0xEE, sizeof back);
        TEST_ASSERT_EQUAL(STORE_OK, store_load(LAYOUT, back, size));
        TEST_ASSERT_EQUAL_MEMORY(bytes, back, size);
    }
}

/* What follows the caller's record in memory is not his. */
void test_the_rest_of_the_last_unit_stays_blank(void)
{
    static const uint8_t bytes[16] = {1, 2, 3, 4, 5, 6, 7, 8, 9};
    TEST_ASSERT_TRUE(store_save(LAYOUT, bytes, 9, &failed_sectors));
    TEST_ASSERT_EACH_EQUAL_HEX8(0xFF, &memory[0][STORE_HEADER_SIZE + 9U], 7);
}

/* One attempt, as there is one sector besides that of the newest record. */
void test_after_a_part_that_cannot_be_programmed_nothing_more_is_programmed(void)
{
    TEST_ASSERT_TRUE(save(1));
    programs = 0;
    program_fails = true;
    TEST_ASSERT_FALSE(save(2));
    TEST_ASSERT_EQUAL_INT(1, programs);
    TEST_ASSERT_EQUAL_UINT32(1, failed_sectors);
    TEST_ASSERT_EQUAL_UINT32(1, loaded());
}

void test_the_largest_record_fits(void)
{
    static uint8_t large[STORE_RECORD_MAX], back[STORE_RECORD_MAX];
    memset(large, 0x5A, sizeof large);
    TEST_ASSERT_TRUE(store_save(LAYOUT, large, sizeof large, &failed_sectors));
    TEST_ASSERT_EQUAL(STORE_OK, store_load(LAYOUT, back, sizeof back));
    TEST_ASSERT_EQUAL_MEMORY(large, back, sizeof back);
}
