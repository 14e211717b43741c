/* SPDX-License-Identifier: Apache-2.0 */
#ifndef SCOPE_COLUMNS_H
#define SCOPE_COLUMNS_H
/** Where a captured signal is found: a column of the ring's slots, or a value of the task's step.
 * Source   the list in scope/signal_list.h
 * Units    raw half words, scope/signal_list.h
 * Range    signals below CAPTURE_SIGNALS
 * Errors   none
 * Context  1 kHz task; the fast ISR may write other slots of the ring meanwhile */
#include <stddef.h>

#include "fx/codegen.h"
#include "scope/capture_state.h"

/** A signal from the capture's next period on. */
typedef struct {
    const uint8_t *from;
    size_t stride; /* bytes from one sample to the next; 0: a value of the step */
} column_t;

typedef int16_t FX_ANY_OBJECT halfword_t;

static inline int16_t value_at(const uint8_t *from)
{
    return *(const halfword_t *)(const void *)from;
}

static inline uint32_t lesser(uint32_t a, uint32_t b)
{
    return (a < b) ? a : b;
}

/** Bytes in the ring from one sample to the next. */
static inline size_t stride_of(const capture_t *capture)
{
    return capture->config.divisor * sizeof(sample_t);
}

/** A signal's place, a byte, is in the period's sample if it is smaller, otherwise in the values of the step. */
#define FROM_STEP sizeof(sample_t)

static inline bool is_of_step(uint8_t place)
{
    return place >= FROM_STEP;
}

static inline column_t column_of_step(const capture_t *capture, uint8_t place)
{
    return (column_t){(const uint8_t *)&capture->values + (place - FROM_STEP), 0};
}

/** What is the same during a whole capture: once, when it begins. */
void columns_find(capture_t *capture);
/** The place of a captured signal. */
uint8_t columns_place(const capture_t *capture, uint32_t k);
column_t columns_at(const capture_t *capture, uint8_t place, const sample_t *next);
/** The trigger's signal. */
static inline column_t column_of_trigger(const capture_t *capture, const sample_t *next)
{
    return columns_at(capture, capture->trigger_place, next);
}

#endif
