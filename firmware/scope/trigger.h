/* SPDX-License-Identifier: Apache-2.0 */
#ifndef SCOPE_TRIGGER_H
#define SCOPE_TRIGGER_H
/** What an armed capture waits for: a signal's level or edge, a command, a fault.
 * Source   docs/howto/scope.md
 * Units    raw half words, samples
 * Range    a valid configuration
 * Errors   none
 * Context  1 kHz task */
#include "scope/columns.h"

/** Before an edge can trigger, the signal must have been on the other side of the level. */
void trigger_reset(capture_t *capture);
/** The samples before the trigger, from the next period on; `count` if it is not among as many. The search begins when
 * enough samples lie before it; a command or a fault is not kept waiting. */
uint32_t trigger_search(capture_t *capture, const sample_t *next, uint32_t count);

#endif
