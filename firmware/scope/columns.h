/* SPDX-License-Identifier: Apache-2.0 */
#ifndef SCOPE_COLUMNS_H
#define SCOPE_COLUMNS_H
/** Where a captured signal is found: one column of the ring's slots, or a value of the task's step.
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

/** The places of the signals: once, when a capture begins. */
void columns_find(capture_t *capture);
/** The trigger's signal. */
column_t column_of_trigger(const capture_t *capture, const sample_t *next);
/** Copies `count` samples, at least one, of all captured signals, from the next period on. The samples must be
 * contiguous in the ring. */
void columns_copy(const capture_t *capture, int16_t *to, const sample_t *next, uint32_t count);

#endif
