/* SPDX-License-Identifier: Apache-2.0 */
#ifndef SCOPE_COPY_H
#define SCOPE_COPY_H
/** Copies samples from the ring to the memory: by the port's hardware if it has any (hal/gather.h), else by the
 * processor.
 * Source   docs/decisions/020-scope.md
 * Units    samples, rows of the memory
 * Range    a valid configuration
 * Errors   a copy that did not end is counted in `lost`
 * Context  1 kHz task; the fast ISR may write other slots of the ring meanwhile */
#include <stdbool.h>
#include <stdint.h>

#include "hal/gather.h"
#include "scope/capture_state.h"

/** When a capture begins. A small memory may get a row twice in a step, and the hardware does not keep the order. */
static inline void copy_reset(capture_t *capture)
{
    capture->gather = (uint8_t)((capture->config.samples >= SAMPLE_SLOTS) ? GATHER_NOT_SET_UP : GATHER_NEVER);
}
/** The port has no hardware (hal/gather.h), or a copy of the last step has not ended: this is counted, and the hardware
 * is not used again until it is idle, in this capture not at all. */
void copy_refuse(capture_t *capture);
/** Before the first copy of a step. */
static inline void copy_begin(capture_t *capture)
{
    if (hal_gather_is_idle()) {
        capture->parts = 0;
    } else {
        copy_refuse(capture);
    }
}
/** The hardware copies samples of this step. */
static inline bool copy_is_pending(const capture_t *capture)
{
    return capture->parts != 0U && capture->parts <= HAL_GATHER_PARTS;
}
/** Copies `count` samples, at least one, of all captured signals, from the next period on; they are contiguous in the
 * ring and in the memory. */
void copy_samples(capture_t *capture, int16_t *memory, const sample_t *next, uint32_t count);
/** After the last copy of a step: the hardware, if there is any, copies while the task continues. */
static inline void copy_end(capture_t *capture)
{
    if (copy_is_pending(capture)) {
        hal_gather_start(capture->parts);
    }
}
/** The next sample does not follow the last one, in the ring or in the memory. */
static inline void copy_move(capture_t *capture)
{
    if (capture->gather == GATHER_CONTINUES) {
        capture->gather = GATHER_SET_UP;
    }
}

#endif
