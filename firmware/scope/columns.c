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

/* Bytes in the ring from one sample to the next. */
static size_t stride_of(const capture_t *capture)
{
    return capture->config.divisor * sizeof(sample_t);
}

void columns_find(capture_t *capture)
{
    const uint32_t signals = capture->config.signals;
    capture->of_step = 0;
    for (uint32_t k = 0; k < signals; k++) {
        const uint8_t place = places[capture->config.signal[k]];
        capture->place[k] = (uint8_t)(place % FROM_STEP);
        capture->of_step = (uint8_t)(capture->of_step | ((place >= FROM_STEP) ? 1U << k : 0U));
    }
    capture->trigger_place = places[capture->config.trigger_signal];
    capture->uses_step = capture->of_step != 0U || capture->trigger_place >= FROM_STEP;
}

column_t column_of_trigger(const capture_t *capture, const capture_source_t *source)
{
    const uint8_t place = capture->trigger_place;
    if (place >= FROM_STEP) {
        return (column_t){(const uint8_t *)source->step + (place - FROM_STEP), 0};
    }
    const sample_t *slot = &source->slot[capture->next % SAMPLE_SLOTS];
    return (column_t){(const uint8_t *)slot + place, stride_of(capture)};
}

/* The number of signals is a constant: a value takes two instructions. */
static inline FX_INLINED_IF_OPTIMISED void copy_row(int16_t *to, const uint8_t *from, const size_t *place,
                                                    const uint32_t signals)
{
    FX_UNROLLED
    for (uint32_t k = 0; k < signals; k++) {
        to[k] = value_at(&from[place[k]]);
    }
}

/* Two rows per pass; the places stay in registers. */
static inline FX_INLINED_IF_OPTIMISED void copy_each(const capture_t *capture, int16_t *first, const uint8_t *oldest,
                                                     uint32_t count, const uint32_t signals)
{
    int16_t *to = first;
    const uint8_t *from = oldest;
    const size_t stride = stride_of(capture);
    size_t place[CAPTURE_SIGNALS_MAX];
    FX_UNROLLED
    for (uint32_t k = 0; k < signals; k++) {
        place[k] = capture->place[k];
    }
    if (count % 2U != 0U) {
        copy_row(to, from, place, signals);
        to = &to[signals];
        from = &from[stride];
    }
    for (uint32_t left = count / 2U; left > 0U; left--) {
        FX_ADDRESS_ONCE(from);
        copy_row(to, from, place, signals);
        from = &from[stride];
        FX_ADDRESS_ONCE(from);
        copy_row(&to[signals], from, place, signals);
        from = &from[stride];
        to = &to[2U * (size_t)signals];
    }
}

#define COPY(signals) \
    case (signals): \
        copy_each(capture, to, from, count, (signals)); \
        break;

/* Not inlined: within another function there would be too few registers. */
static FX_NOT_INLINED void copy_rows(const capture_t *capture, int16_t *to, const uint8_t *from, uint32_t count)
{
    switch (capture->config.signals) {
        COPY(1U)
        COPY(2U)
        COPY(3U)
        COPY(4U)
        COPY(5U)
        COPY(6U)
        COPY(7U)
    default:
        copy_each(capture, to, from, count, CAPTURE_SIGNALS_MAX);
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
    copy_rows(capture, to, (const uint8_t *)&source->slot[capture->next % SAMPLE_SLOTS], count);
    if (capture->of_step != 0U) {
        fill_step(capture, to, source->step, count);
    }
}
