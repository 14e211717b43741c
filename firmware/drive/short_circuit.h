/* SPDX-License-Identifier: Apache-2.0 */
#ifndef DRIVE_SHORT_CIRCUIT_H
#define DRIVE_SHORT_CIRCUIT_H
/** The active short circuit at the bridge: all lower switches on, or all upper ones where the lower ones cannot serve.
 *   The gate signals are read back. If those that were on are off a period later, the gate drivers have ended the short
 *   circuit: a switch of the other side is shorted, and switching on against it short-circuits the dc link. The other
 *   side is then tried, on which the shorted switch does no harm. If the drivers end that one, too, switching stays
 *   disabled. The task chooses the first side (safety/short_side.h), unless the currents after a gate fault show that
 *   of a shorted switch (safety/shorted_switch.h). Where a switch of the side does not switch on
 *   (safety/open_switch.h), it is changed, at most twice until the bridge runs again. None of these applies once the
 *   drivers have ended one side.
 *   While the fault line is active nothing can be switched on; this does not count as a failure of a side.
 *   After a fault the currents may have any value, and a short circuit would rotate their flux about the origin. For
 *   half a step of the task switching is therefore disabled first, and the dc link opposes the currents. This wait is
 *   left out after an over-voltage, which the energy of the currents would raise, and after faults that leave control
 *   intact: then the currents have been moved before. After the faults of a phase (types/faults.h) it ends where the
 *   flux of the tables is smaller than that of the magnets, to which the wait would raise it. After a gate fault it
 *   ends once the side is known, a current flows, or two periods have passed since the period of the fault.
 * Source   docs/theory/safe-state.md (SS-11), (SS-20), (SS-21), (SS-30), (SS-31)
 * Units    PWM periods
 * Range    up to 255 periods of waiting
 * Errors   none: if the drivers end the short circuit on both sides, switching stays disabled
 * Context  fast ISR, in every period of the short circuit */
#include "drive/drive.h"

/** A period in which the bridge does not run. */
typedef struct {
    const sample_t *sample;
    abc_q15_t i;        /* of the phases, in this sample */
    fx_pair_t rotation; /* cosine, sine of its angle */
    int32_t angle_step; /* of the field since the period before, 2^32 = one turn */
} safe_period_t;

/** upper: the side that the task has chosen. */
void short_circuit_step(drive_t *drive, const safe_period_t *now, bool upper);
/** The same without the search; found: the switch that the search has found in this period. */
void short_circuit_apply(fast_state_t *fast, bool upper, open_switch_t found);

/** While the bridge runs: after the next fault switching is disabled for so many periods before a short circuit. */
void short_circuit_prepare(fast_state_t *fast, uint32_t periods);

/** Whether switching stays disabled in this period, before the short circuit; called once per period. */
bool short_circuit_waits(fast_state_t *fast);

/** The same with what may end the wait: the search for a shorted switch, or a small flux. Called once per
 * period of a fault in place of short_circuit_waits(). */
bool short_circuit_may_begin(drive_t *drive, const safe_period_t *now);

/** Ends the short circuit: switching is disabled, and the duties are one half. */
void short_circuit_end(fast_state_t *fast);

/** Permits both sides again, after the faults have been reset. A side that the search has found is kept. */
void short_circuit_reset(fast_state_t *fast);

/** Whether the latched faults need the short circuit. An over-voltage that a jump of the sensor has caused counts as
 * none (MN-50). */
bool short_circuit_is_needed(const fast_state_t *fast, safe_t safe);

#endif
