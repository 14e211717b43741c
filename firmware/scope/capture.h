/* SPDX-License-Identifier: Apache-2.0 */
#ifndef SCOPE_CAPTURE_H
#define SCOPE_CAPTURE_H
/** Capture of up to 8 signals of every PWM period, or of every so many, with samples before a trigger.
 *   The fast ISR always keeps its last periods in a ring (drive/exchange.h). The task copies the periods since its last
 *   step and searches them for the trigger. The memory holds one row of values, one of each
 *   signal, for each of `samples` samples; the rows are filled in a circle until the trigger.
 * Source   docs/howto/scope.md; docs/decisions/020-scope.md
 * Units    raw half words, scope/signal_list.h
 * Range    capture_config_is_valid()
 * Errors   a task that comes so late that the ring has lost periods: the search begins anew, or the capture ends early;
 *          both are counted in `lost`, and so is a copy of the port's hardware that did not end: its samples are wrong
 * Context  1 kHz task; the fast ISR may write other slots of the ring meanwhile */
#include "scope/capture_state.h"

bool capture_config_is_valid(const capture_config_t *config);
/** Waits for the trigger from the period after `newest`. The configuration is valid. */
void capture_arm(capture_t *capture, const capture_config_t *config, uint32_t newest);
/** Records around a period that has already passed, as far as the ring reaches back. */
void capture_freeze(capture_t *capture, const capture_config_t *config, uint32_t period, uint32_t newest);
/** An armed capture triggers in this period, or at once if it is past. */
void capture_trigger(capture_t *capture, uint32_t period);
/** Releases the memory. */
void capture_stop(capture_t *capture);
/** Copies the periods that have come since the last step. slot: the ring; newest: its newest period. */
void capture_step(capture_t *capture, int16_t *memory, const sample_t *slot, uint32_t newest);

#endif
