/* SPDX-License-Identifier: Apache-2.0 */
#ifndef DRIVE_SHORT_CIRCUIT_H
#define DRIVE_SHORT_CIRCUIT_H
/** The active short circuit at the bridge: all lower switches on, or all upper ones where the lower cannot be.
 *   The gates are read back. If those that were on are off a period later, the gate drivers have ended the short
 *   circuit: a switch of the other side is shorted, and switching on against it short-circuits the dc link. The other
 *   side is then tried, on which the shorted switch does no harm. If the drivers end that one, too, switching stays
 *   disabled. The task may request the upper switches (safety/short_side.h), before the short circuit or while the
 *   lower ones are on. The request acts only while the lower switches are used and no side has been ended; the upper
 *   ones are then kept until the faults are reset.
 *   While the fault line is active nothing can be switched on: that is no failure of a side.
 *   After a fault the currents may be any; the short circuit would turn them about its own. For half a step of the
 *   task switching is therefore disabled first, and the dc link ends them. Not after an over-voltage, which their
 *   energy would raise, after a gate fault, nor after what leaves control intact, which has moved the currents before.
 * Source   docs/theory/safe-state.md (SS-11), (SS-20), (SS-21)
 * Context  fast ISR, in every period of the short circuit */
#include "drive/drive.h"

void short_circuit_apply(fast_state_t *fast, bool upper);

/** The bridge runs: what a short circuit after the next fault begins with. */
void short_circuit_prepare(fast_state_t *fast, uint32_t periods);

/** Whether switching is disabled first in this period, the bridge having run before; called once in each. */
bool short_circuit_waits(fast_state_t *fast);

/** No short circuit any more: switching is disabled, and the duties are one half. */
void short_circuit_end(fast_state_t *fast);

/** Both sides may be tried again: the faults are reset. */
void short_circuit_reset(fast_state_t *fast);

/** Whether the fault that is latched needs the short circuit. */
bool short_circuit_is_needed(uint32_t faults, safe_t safe);

#endif
