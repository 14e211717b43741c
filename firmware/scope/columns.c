/* SPDX-License-Identifier: Apache-2.0 */
#include "scope/columns.h"

#include "fx/codegen.h"

#define FROM_STEP sizeof(sample_t)

/* Places below FROM_STEP are in the period's sample, the others in the values of the step. */
#define PERIOD(field) offsetof(sample_t, field)
#define UPPER(field) (offsetof(sample_t, field) + sizeof(int16_t))
#define STEP(field) (FROM_STEP + offsetof(scope_step_values_t, field))
#define PLACE(name, base, place, text) (uint8_t)(place),

static const uint8_t places[CAPTURE_SIGNALS] = {SCOPE_SIGNAL_LIST(PLACE)};

_Static_assert(FROM_STEP + sizeof(scope_step_values_t) <= UINT8_MAX, "a place is a byte");
_Static_assert(sizeof(scope_step_values_t) <= FROM_STEP, "its places, taken in a slot, are within the slot");

typedef struct {
    const uint8_t *from;
    size_t stride;
    uint32_t count;
} rows_t;

void columns_find(capture_t *capture)
{
    capture->of_step = 0;
    for (uint32_t k = 0; k < capture->config.signals; k++) {
        const uint8_t place = places[capture->config.signal[k]];
        capture->place[k] = (uint8_t)(place % FROM_STEP);
        capture->of_step = (uint8_t)(capture->of_step | ((place >= FROM_STEP) ? 1U << k : 0U));
    }
}

column_t column_of(const capture_t *capture, const capture_source_t *source, uint8_t signal)
{
    const uint8_t place = places[signal];
    if (place >= FROM_STEP) {
        return (column_t){(const uint8_t *)source->step + (place - FROM_STEP), 0};
    }
    const sample_t *slot = &source->slot[capture->next % SAMPLE_SLOTS];
    return (column_t){(const uint8_t *)slot + place, capture->config.divisor * sizeof(sample_t)};
}

/* At least one row. The number of signals is a constant: their places stay in registers, and a value takes two
 * instructions. */
static inline FX_INLINED void copy_each(int16_t *first, rows_t rows, const uint8_t *places_in_row,
                                        const uint32_t signals)
{
    size_t place[CAPTURE_SIGNALS_MAX];
    FX_UNROLLED
    for (uint32_t k = 0; k < signals; k++) {
        place[k] = places_in_row[k];
    }
    const uint8_t *from = rows.from;
    int16_t *to = first;
    uint32_t left = rows.count;
    do {
        FX_UNROLLED
        for (uint32_t k = 0; k < signals; k++) {
            to[k] = value_at(&from[place[k]]);
        }
        to = &to[signals];
        from = &from[rows.stride];
        left--;
    } while (left > 0U);
}

#define COPY(signals) \
    case (signals): \
        copy_each(to, rows, place, (signals)); \
        break;

/* Not inlined: within another function there would be too few registers. */
static FX_NOT_INLINED void copy_rows(int16_t *to, rows_t rows, const uint8_t *place, uint32_t signals)
{
    switch (signals) {
        COPY(1U)
        COPY(2U)
        COPY(3U)
        COPY(4U)
        COPY(5U)
        COPY(6U)
        COPY(7U)
    default:
        copy_each(to, rows, place, CAPTURE_SIGNALS_MAX);
        break;
    }
}

/* Writes the step's values, which are constant during the step, over what the rows contain in their places. */
static void fill_step(const capture_t *capture, int16_t *to, const scope_step_values_t *step, uint32_t count)
{
    const uint32_t signals = capture->config.signals;
    for (uint32_t k = 0; k < signals; k++) {
        if ((capture->of_step & 1U << k) != 0U) {
            const int16_t value = value_at((const uint8_t *)step + capture->place[k]);
            for (uint32_t n = 0; n < count; n++) {
                to[n * signals + k] = value;
            }
        }
    }
}

void columns_copy(const capture_t *capture, int16_t *to, const capture_source_t *source, uint32_t count)
{
    const size_t stride = capture->config.divisor * sizeof(sample_t);
    const rows_t rows = {(const uint8_t *)&source->slot[capture->next % SAMPLE_SLOTS], stride, count};
    copy_rows(to, rows, capture->place, capture->config.signals);
    if (capture->of_step != 0U) {
        fill_step(capture, to, source->step, count);
    }
}
