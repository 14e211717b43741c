/* SPDX-License-Identifier: Apache-2.0 */
/* The store on a flash with several slots in each sector: the numbers of slots are the S32K144's. */
#include <string.h>

#include "storage/store.h"
#include "unity.h"

#define LAYOUT 0x46540001U
#define NEVER INT32_MAX
#define SECTORS (HAL_NVM_SLOTS / HAL_NVM_SECTOR_SLOTS)
#define SECTOR_SIZE (HAL_NVM_SECTOR_SLOTS * HAL_NVM_SLOT_SIZE)
#define RATED_CYCLES 1000U /* S32K1xx data sheet, NVM reliability: program and data flash */
#define SAVES_OF_TEN_YEARS (10U * 365U * 2U)

/* A simulated flash. Writing can only clear bits; the power fails when `energy` units have been programmed or
 * sixteenths of a sector erased, and what was being changed then is left with random bits. */
static uint8_t memory[HAL_NVM_SLOTS * HAL_NVM_SLOT_SIZE];
static int32_t energy;
static uint32_t erases[SECTORS], state;
static uint32_t failing_sector; /* its erase fails; SECTORS: none */
static uint32_t weak_sectors;   /* from sector 1 on, this many erase but cannot be programmed */
static uint32_t failed_sectors; /* as the store counts them */

typedef struct {
    uint32_t number;
    uint8_t body[73];
} record_t;

static record_t record_of(uint32_t number)
{
    record_t r = {.number = number};
    for (uint32_t k = 0; k < sizeof r.body; k++) {
        r.body[k] = (uint8_t)(number * 31U + k * 7U);
    }
    return r;
}

static uint8_t any(void)
{
    state = state * 1664525U + 1013904223U;
    return (uint8_t)(state >> 24);
}

static uint32_t bytes_read;

bool hal_nvm_read(uint32_t slot, uint32_t offset, void *data, uint32_t size)
{
    bytes_read += size;
    TEST_ASSERT_TRUE(slot < HAL_NVM_SLOTS && offset + size <= HAL_NVM_SLOT_SIZE);
    memcpy(data, &memory[slot * HAL_NVM_SLOT_SIZE + offset], size);
    return true;
}

bool hal_nvm_erase(uint32_t slot)
{
    TEST_ASSERT_TRUE(slot < HAL_NVM_SLOTS && slot % HAL_NVM_SECTOR_SLOTS == 0U);
    const uint32_t sector = slot / HAL_NVM_SECTOR_SLOTS, part = SECTOR_SIZE / 16U;
    erases[sector]++;
    if (sector == failing_sector) {
        return false;
    }
    for (uint32_t k = 0; k < 16U; k++) {
        uint8_t *cells = &memory[sector * SECTOR_SIZE + k * part];
        if (energy-- <= 0) {
            for (uint32_t n = 0; n < part; n++) {
                cells[n] |= any();
            }
            return false;
        }
        memset(cells, 0xFF, part);
    }
    return true;
}

bool hal_nvm_program(uint32_t slot, uint32_t offset, const void *data, uint32_t size)
{
    TEST_ASSERT_TRUE(offset % HAL_NVM_UNIT == 0 && size % HAL_NVM_UNIT == 0 && offset + size <= HAL_NVM_SLOT_SIZE);
    if (slot / HAL_NVM_SECTOR_SLOTS - 1U < weak_sectors) {
        return false;
    }
    for (uint32_t k = 0; k < size; k++) {
        uint8_t *cell = &memory[slot * HAL_NVM_SLOT_SIZE + offset + k];
        const uint8_t byte = ((const uint8_t *)data)[k];
        if (k % HAL_NVM_UNIT == 0U && energy-- <= 0) {
            *cell &= (uint8_t)(byte | any());
            return false;
        }
        TEST_ASSERT_EQUAL_HEX8_MESSAGE(0xFF, *cell, "programmed without an erase");
        *cell = byte;
    }
    return true;
}

void setUp(void)
{
    memset(memory, 0xFF, sizeof memory);
    memset(erases, 0, sizeof erases);
    energy = NEVER;
    failing_sector = SECTORS;
    weak_sectors = failed_sectors = 0;
    state = 1;
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

static uint32_t most_erased(void)
{
    uint32_t most = 0;
    for (uint32_t k = 0; k < SECTORS; k++) {
        most = (erases[k] > most) ? erases[k] : most;
    }
    return most;
}

void test_the_newest_of_many_saves_is_loaded(void)
{
    for (uint32_t number = 1; number <= 3U * HAL_NVM_SLOTS; number++) {
        TEST_ASSERT_TRUE(save(number));
        TEST_ASSERT_EQUAL_UINT32(number, loaded());
        TEST_ASSERT_EQUAL_UINT32(most_erased(), store_erase_cycles());
    }
    TEST_ASSERT_EQUAL_UINT32(3, most_erased());
}

void test_an_empty_flash_has_no_cycles(void)
{
    TEST_ASSERT_EQUAL_UINT32(0, store_erase_cycles());
}

/* Two drives a day, a save after each. */
void test_ten_years_use_less_than_a_tenth_of_the_rated_cycles(void)
{
    for (uint32_t number = 1; number <= SAVES_OF_TEN_YEARS; number++) {
        TEST_ASSERT_TRUE(save(number));
    }
    TEST_ASSERT_EQUAL_UINT32(SAVES_OF_TEN_YEARS, loaded());
    TEST_ASSERT_LESS_OR_EQUAL_UINT32(RATED_CYCLES / 10U, most_erased());
    TEST_ASSERT_EQUAL_UINT32(most_erased(), store_erase_cycles());
}

/* Whole saves before the cut one, which then finds a blank slot, the end of a sector, or the end of the flash. */
static const uint32_t before[] = {1, 2, 3, 4, 5, HAL_NVM_SLOTS - 1, HAL_NVM_SLOTS, HAL_NVM_SLOTS + 1};

void test_a_cut_at_any_unit_of_a_save_leaves_the_old_or_the_new_record(void)
{
    for (uint32_t n = 0; n < sizeof before / sizeof before[0]; n++) {
        bool done = false;
        for (int32_t cut = 0; !done; cut++) {
            setUp();
            state = (uint32_t)cut;
            for (uint32_t number = 1; number <= before[n]; number++) {
                TEST_ASSERT_TRUE(save(number));
            }
            energy = cut;
            done = save(before[n] + 1U);
            TEST_ASSERT_EQUAL_UINT32(before[n] + (done ? 1U : 0U), loaded());
            energy = NEVER; /* the next save works on the interrupted one */
            TEST_ASSERT_TRUE(save(1000));
            TEST_ASSERT_EQUAL_UINT32(1000, loaded());
        }
    }
}

/* The save after an interrupted one is interrupted, too. */
void test_two_cuts_in_a_row_leave_one_of_the_three_records(void)
{
    for (int32_t first = 0; first < 29; first++) {
        for (int32_t second = 0; second < 46; second++) {
            setUp();
            state = (uint32_t)(first * 64 + second);
            TEST_ASSERT_TRUE(save(1) && save(2) && save(3));
            energy = first;
            uint32_t newest = save(4) ? 4 : 3;
            energy = second;
            newest = save(5) ? 5 : newest;
            TEST_ASSERT_EQUAL_UINT32(newest, loaded());
            energy = NEVER;
            TEST_ASSERT_TRUE(save(6));
            TEST_ASSERT_EQUAL_UINT32(6, loaded());
        }
    }
}

void test_a_half_written_slot_is_passed_over(void)
{
    TEST_ASSERT_TRUE(save(1));
    energy = 3;
    TEST_ASSERT_FALSE(save(2));
    energy = NEVER;
    TEST_ASSERT_TRUE(save(3));
    TEST_ASSERT_EQUAL_UINT32(3, loaded());
    TEST_ASSERT_EQUAL_HEX8(0xFF, memory[HAL_NVM_SLOT_SIZE]); /* the header of slot 1 */
    TEST_ASSERT_EQUAL_UINT32(1, erases[0]);
}

void test_a_sector_that_cannot_be_erased_is_passed_over(void)
{
    for (uint32_t number = 1; number <= HAL_NVM_SLOTS; number++) {
        TEST_ASSERT_TRUE(save(number));
    }
    failing_sector = 0;
    TEST_ASSERT_TRUE(save(1000));
    TEST_ASSERT_EQUAL_UINT32(1000, loaded());
    TEST_ASSERT_EQUAL_UINT32(2, erases[1]);
    TEST_ASSERT_EQUAL_UINT32(1, failed_sectors);
}

/* From the last slot before them on: two attempts in the same sector would end each save. */
void test_sectors_that_erase_but_cannot_be_programmed_are_passed_over(void)
{
    for (weak_sectors = 1; weak_sectors <= 3U; weak_sectors++) {
        const uint32_t weak = weak_sectors;
        setUp();
        weak_sectors = weak;
        for (uint32_t number = 1; number <= 3U * HAL_NVM_SLOTS; number++) {
            TEST_ASSERT_TRUE(save(number));
            TEST_ASSERT_EQUAL_UINT32(number, loaded());
        }
        TEST_ASSERT_GREATER_OR_EQUAL_UINT32(3U * weak, failed_sectors);
        TEST_ASSERT_EQUAL_UINT32(erases[1] * weak, failed_sectors);
    }
}

void test_more_of_them_end_the_save_and_keep_the_record(void)
{
    for (uint32_t number = 1; number <= HAL_NVM_SECTOR_SLOTS; number++) {
        TEST_ASSERT_TRUE(save(number));
    }
    weak_sectors = SECTORS - 1U;
    TEST_ASSERT_FALSE(save(1000));
    TEST_ASSERT_EQUAL_UINT32(4, failed_sectors);
    TEST_ASSERT_EQUAL_UINT32(HAL_NVM_SECTOR_SLOTS, loaded());
}

/* At a start the watchdog allows 100 ms: every header is read twice at most, every record once. */
void test_with_every_slot_damaged_each_is_read_once(void)
{
    for (uint32_t slot = 0; slot < HAL_NVM_SLOTS; slot++) {
        const uint32_t header[4] = {LAYOUT, STORE_RECORD_MAX, slot, 0};
        memcpy(&memory[slot * HAL_NVM_SLOT_SIZE], header, sizeof header);
    }
    record_t record;
    bytes_read = 0;
    TEST_ASSERT_EQUAL_INT(STORE_DAMAGED, store_load(LAYOUT, &record, sizeof record));
    TEST_ASSERT_LESS_OR_EQUAL_UINT32(HAL_NVM_SLOTS * (STORE_RECORD_MAX + 2U * STORE_HEADER_SIZE), bytes_read);
}
