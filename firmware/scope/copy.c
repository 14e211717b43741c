/* SPDX-License-Identifier: Apache-2.0 */
#include "scope/copy.h"

#include "fx/codegen.h"
#include "hal/gather.h"
#include "scope/columns.h"

_Static_assert(CAPTURE_SIGNALS_MAX <= HAL_GATHER_COLUMNS, "a column of the hardware for each signal");
_Static_assert(SAMPLE_SLOTS * sizeof(sample_t) <= INT16_MAX, "several rows in the ring have such a distance");

void copy_refuse(capture_t *capture)
{
    capture->parts = GATHER_CLOSED;
    if (capture->gather == GATHER_CONTINUES) {
        capture->gather = GATHER_NEVER;
        capture->lost++;
    }
}

/* The place of the next row. */
static int16_t *row(const capture_t *capture, int16_t *memory)
{
    return &memory[(size_t)capture->at * capture->config.signals];
}

/* By the processor. */
static FX_NOT_INLINED void copy_rows(const capture_t *capture, int16_t *memory, const sample_t *next, uint32_t count)
{
    const uint32_t signals = capture->config.signals;
    int16_t *first = row(capture, memory);
    for (uint32_t k = 0; k < signals; k++) {
        const column_t values = columns_at(capture, columns_place(capture, k), next);
        int16_t *to = &first[k];
        const uint8_t *from = values.from;
        for (uint32_t left = count; left > 0U; left--) {
            *to = value_at(from);
            to = &to[signals];
            from = &from[values.stride];
        }
    }
}

static FX_NOT_INLINED FX_COLD void set_up_columns(const capture_t *capture)
{
    const uint32_t signals = capture->config.signals;
    uint32_t stride[CAPTURE_SIGNALS_MAX];
    for (uint32_t k = 0; k < signals; k++) {
        stride[k] = is_of_step(columns_place(capture, k)) ? 0U : (uint32_t)stride_of(capture);
    }
    hal_gather_set_up(signals, stride, signals * (uint32_t)sizeof(int16_t));
}

/* Also the columns that are not captured: their signals are valid, and a loop that counts would take longer. */
static void move(const capture_t *capture, int16_t *first, const sample_t *next)
{
    FX_UNROLLED
    for (uint32_t k = 0; k < CAPTURE_SIGNALS_MAX; k++) {
        hal_gather_move(k, columns_at(capture, columns_place(capture, k), next).from, &first[k]);
    }
}

/* False: the processor must copy. */
static FX_NOT_INLINED bool prepare(capture_t *capture, int16_t *memory, const sample_t *next)
{
    if (capture->gather == (uint8_t)GATHER_NOT_SET_UP) {
        set_up_columns(capture);
        capture->gather = GATHER_SET_UP;
    }
    if (capture->gather != (uint8_t)GATHER_SET_UP && capture->gather != (uint8_t)GATHER_CONTINUES) {
        return false;
    }
    move(capture, row(capture, memory), next);
    capture->gather = GATHER_CONTINUES;
    return true;
}

/* A part of the copy that the hardware will make; a second one has columns of its own. */
static bool gather(capture_t *capture, int16_t *memory, const sample_t *next, uint32_t count)
{
    const bool is_further = capture->parts != 0U;
    const bool is_moved = capture->gather != GATHER_CONTINUES || is_further;
    if (is_moved && !prepare(capture, memory, next)) {
        return false;
    }
    hal_gather_add(count, is_further);
    capture->parts++;
    return true;
}

void copy_samples(capture_t *capture, int16_t *memory, const sample_t *next, uint32_t count)
{
    if (capture->parts >= HAL_GATHER_PARTS || !gather(capture, memory, next, count)) {
        copy_rows(capture, memory, next, count);
        copy_move(capture);
    }
}
