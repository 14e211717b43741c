/* SPDX-License-Identifier: Apache-2.0 */
#ifndef SCOPE_COLUMNS_H
#define SCOPE_COLUMNS_H
/** Where a captured signal is found, a column of the ring's slots or a value of the task's step, and how it is copied.
 * Source   the list in scope/signal_list.h
 * Units    raw half words, scope/signal_list.h
 * Range    signals below CAPTURE_SIGNALS
 * Errors   a copy that did not end is counted in `lost`
 * Context  1 kHz task; the fast ISR may write other slots of the ring meanwhile */
#include <stddef.h>

#include "fx/codegen.h"
#include "hal/gather.h"
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
/** The trigger's signal. */
column_t column_of_trigger(const capture_t *capture, const sample_t *next);
/** The port has no hardware (hal/gather.h), or a copy of the last step has not ended: this is counted, and the hardware
 * is not used again until it is idle, in this capture not at all. */
void columns_refuse(capture_t *capture);
/** Before the first copy of a step. */
static inline void columns_begin(capture_t *capture)
{
    if (hal_gather_is_idle()) {
        capture->parts = 0;
    } else {
        columns_refuse(capture);
    }
}
/** The hardware copies samples of this step. */
static inline bool columns_are_pending(const capture_t *capture)
{
    return capture->parts != 0U && capture->parts <= HAL_GATHER_PARTS;
}
/** Copies `count` samples, at least one, of all captured signals, from the next period on; they are contiguous in the
 * ring and in the memory. */
void columns_copy(capture_t *capture, int16_t *memory, const sample_t *next, uint32_t count);
/** After the last copy of a step: the hardware, if there is any, copies while the task continues. */
static inline void columns_end(capture_t *capture)
{
    if (columns_are_pending(capture)) {
        hal_gather_start(capture->parts);
    }
}
/** The next sample does not follow the last one, in the ring or in the memory. */
static inline void columns_move(capture_t *capture)
{
    if (capture->gather == GATHER_CONTINUES) {
        capture->gather = GATHER_SET_UP;
    }
}

#endif
