/* SPDX-License-Identifier: Apache-2.0 */
#include "late_gather.h"

#include <string.h>

#include "unity.h"

late_gather_t late_gather;

typedef struct {
    const char *from;
    int16_t *to;
} column_t;

/* The columns as they are when a part is added, and its number of rows. */
typedef struct {
    column_t column[HAL_GATHER_COLUMNS];
    uint32_t count;
} part_t;

static column_t column[HAL_GATHER_COLUMNS];
static uint32_t stride[HAL_GATHER_COLUMNS];
static uint32_t columns, row_size;
static uint32_t moved; /* columns, one bit each, since the last part */
static part_t part[HAL_GATHER_PARTS];
static uint32_t parts;
static bool placed, copying;

void late_gather_reset(bool there)
{
    late_gather = (late_gather_t){.there = there};
    columns = parts = moved = 0;
    placed = copying = false;
}

static void copy_part(const part_t *of)
{
    for (uint32_t k = 0; k < columns; k++) {
        for (uint32_t n = 0; n < of->count; n++) {
            const size_t row = (size_t)n * row_size / sizeof(int16_t);
            memcpy(&of->column[k].to[row], of->column[k].from + (size_t)n * stride[k], sizeof(int16_t));
        }
    }
}

void late_gather_end(void)
{
    if (late_gather.stuck || !copying) {
        return;
    }
    for (uint32_t k = 0; k < parts; k++) {
        copy_part(&part[k]);
    }
    parts = 0;
    copying = false;
}

bool hal_gather_is_idle(void)
{
    return late_gather.there && !copying;
}

static void expect_idle(void)
{
    TEST_ASSERT_TRUE_MESSAGE(hal_gather_is_idle(), "used while it copies");
}

void hal_gather_set_up(uint32_t number, const uint32_t *strides, uint32_t size)
{
    expect_idle();
    TEST_ASSERT_TRUE(number >= 1U && number <= HAL_GATHER_COLUMNS);
    columns = number;
    row_size = size;
    parts = moved = 0;
    placed = false;
    memcpy(stride, strides, number * sizeof *strides);
    late_gather.set_ups++;
}

void hal_gather_move(uint32_t k, const void *from, int16_t *to)
{
    expect_idle();
    TEST_ASSERT_TRUE(k < HAL_GATHER_COLUMNS);
    column[k] = (column_t){from, to};
    moved |= 1U << k;
    late_gather.moves += (k == 0U) ? 1U : 0U;
}

static void expect_part(uint32_t count)
{
    expect_idle();
    TEST_ASSERT_TRUE(columns > 0U && count >= 1U && count <= 64U && parts < HAL_GATHER_PARTS);
    if (moved != 0U || !placed) {
        TEST_ASSERT_EQUAL_UINT32((1U << columns) - 1U, moved & ((1U << columns) - 1U));
    }
    TEST_ASSERT_TRUE_MESSAGE(parts == 0U || moved != 0U, "a further part continues");
    for (uint32_t k = 0; k < columns && count > 1U; k++) {
        TEST_ASSERT_TRUE(stride[k] <= INT16_MAX);
    }
}

void hal_gather_add(uint32_t count, bool is_further)
{
    expect_part(count);
    TEST_ASSERT_EQUAL(parts > 0U, is_further);
    memcpy(part[parts].column, column, sizeof column);
    part[parts].count = count;
    parts++;
    placed = true;
    moved = 0;
    for (uint32_t k = 0; k < columns; k++) {
        column[k].from += (size_t)count * stride[k];
        column[k].to += (size_t)count * row_size / sizeof(int16_t);
    }
    late_gather.parts++;
}

void hal_gather_start(uint32_t number)
{
    expect_idle();
    TEST_ASSERT_TRUE(parts > 0U);
    TEST_ASSERT_EQUAL_UINT32(parts, number);
    copying = true;
    late_gather.copies++;
}
