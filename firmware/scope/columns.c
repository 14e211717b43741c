/* SPDX-License-Identifier: Apache-2.0 */
#include "scope/columns.h"

#include "fx/codegen.h"
#include "fx/q.h"

#define ROWS_AT_ONCE 5U /* half of a step at 10 kHz */
#define FROM_STEP sizeof(sample_t)

/* Places below FROM_STEP are in the period's sample, the others in the values of the step. */
#define PERIOD(field) offsetof(sample_t, field)
#define UPPER(field) (offsetof(sample_t, field) + sizeof(int16_t))
#define STEP(field) (FROM_STEP + offsetof(scope_step_values_t, field))
#define PLACE(name, base, place, text) (uint8_t)(place),

static const uint8_t places[CAPTURE_SIGNALS] = {SCOPE_SIGNAL_LIST(PLACE)};

/* The usual signals are in nine words of a sample, with one word between them that is not used. */
#define IS_WORD(name, field) \
    (offsetof(sample_t, point.i) + offsetof(fx_nine_words_t, name) == offsetof(sample_t, field))
_Static_assert(IS_WORD(b, point.i.q) && IS_WORD(c, point.u.d) && IS_WORD(d, point.u.q) && IS_WORD(e, point.omega) &&
                   IS_WORD(f, theta_e) && IS_WORD(h, zero_q28) && IS_WORD(i, v_dc),
               "copy_usual_row() takes the words of a sample by their order");

static const uint8_t usual[CAPTURE_SIGNALS_MAX] = SCOPE_USUAL_SIGNALS;

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
    capture->usual = signals == CAPTURE_SIGNALS_MAX && capture->config.divisor == 1U;
    for (uint32_t k = 0; k < signals; k++) {
        capture->usual = capture->usual && capture->config.signal[k] == usual[k];
        const uint8_t place = places[capture->config.signal[k]];
        capture->place[k] = (uint8_t)(place % FROM_STEP);
        capture->of_step = (uint8_t)(capture->of_step | ((place >= FROM_STEP) ? 1U << k : 0U));
    }
    capture->trigger_place = places[capture->config.trigger_signal];
    capture->uses_step = capture->of_step != 0U || capture->trigger_place >= FROM_STEP;
}

column_t column_of_trigger(const capture_t *capture, const sample_t *next)
{
    const uint8_t place = capture->trigger_place;
    if (place >= FROM_STEP) {
        return (column_t){(const uint8_t *)&capture->values + (place - FROM_STEP), 0};
    }
    return (column_t){(const uint8_t *)next + place, stride_of(capture)};
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

/* A row of SCOPE_USUAL_SIGNALS, in their order: seven instructions with the address. Returns the place of the next. */
static inline FX_INLINED_IF_OPTIMISED fx_four_words_t *copy_usual_row(fx_four_words_t *to, const sample_t *from)
{
    const fx_nine_words_t x = fx_load_nine_words((const fx_nine_words_t *)(const void *)&from->point.i);
    const fx_four_words_t row = {
        .a = (int32_t)fx_pair(x.a, x.b),
        .b = (int32_t)fx_pair(x.c, x.d),
        .c = (int32_t)fx_pair_lower_upper(x.i, x.e),
        .d = (int32_t)fx_pair_uppers(x.f, x.h),
    };
    return fx_store_four_words(to, row);
}

/* Several rows per pass: their addresses are constant distances apart. */
static FX_NOT_INLINED void copy_usual(int16_t *first, const sample_t *oldest, uint32_t count)
{
    fx_four_words_t *to = (fx_four_words_t *)(void *)first;
    const sample_t *from = oldest;
    uint32_t left = count;
    for (; left >= ROWS_AT_ONCE; left -= ROWS_AT_ONCE) {
        FX_UNROLLED
        for (uint32_t k = 0; k < ROWS_AT_ONCE; k++) {
            to = copy_usual_row(to, &from[k]);
        }
        from = &from[ROWS_AT_ONCE];
    }
    for (; left > 0U; left--) {
        to = copy_usual_row(to, from);
        from = &from[1];
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
static FX_NOT_INLINED void fill_step(const capture_t *capture, int16_t *to, uint32_t count)
{
    const uint32_t signals = capture->config.signals;
    for (uint32_t k = 0; k < signals; k++) {
        if ((capture->of_step & 1U << k) != 0U) {
            const int16_t value = value_at((const uint8_t *)&capture->values + capture->place[k]);
            for (uint32_t n = 0; n < count; n++) {
                to[n * signals + k] = value;
            }
        }
    }
}

void columns_copy(const capture_t *capture, int16_t *to, const sample_t *next, uint32_t count)
{
    if (capture->usual) {
        copy_usual(to, next, count);
        return;
    }
    copy_rows(capture, to, (const uint8_t *)next, count);
    if (capture->of_step != 0U) {
        fill_step(capture, to, count);
    }
}
