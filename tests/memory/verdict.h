/* SPDX-License-Identifier: Apache-2.0 */
#ifndef MEMORY_VERDICT_H
#define MEMORY_VERDICT_H
/** What a flip did, by the shaft torque of the simulated machine against the run without a flip.
 *   masked    never more than 5 N·m apart, no fault
 * A fault is one that is latched, or a state in which the drive does not run: both are transmitted.
 *   early     a fault, before the torques were 5 N·m apart
 *   in time   a fault within 50 ms after they were
 *   passed    more than 5 N·m apart for 50 ms at most, no fault: the value was overwritten
 *   late      a fault after more than 50 ms
 *   silent    more than 5 N·m apart for longer than 50 ms, no fault
 *   stopped   the process ended by a wrong address or a loop: on a target a processor exception or the watchdog
 * Context  test program */
#include <stdint.h>

#include "memory_map.h"

#define TRACE_MS 1000U
#define NO_FAULT UINT32_MAX

typedef struct {
    double shaft_Nm[TRACE_MS]; /* means of a millisecond */
    uint32_t ms, fault_ms, faults;
    int ended; /* not 0: signal or exit code */
} trace_t;

typedef enum { MASKED, EARLY, IN_TIME, PASSED, LATE, SILENT, STOPPED, VERDICTS } verdict_t;

typedef struct {
    unsigned count[MEMORY_BLOCKS_MAX][VERDICTS];
    unsigned longest_passed_ms, longest_in_time_ms;
} tally_t;

void classify(tally_t *tally, const trace_t *golden, const trace_t *trace, const place_t *place, double rpm);
/** Prints the table; 0 if nothing was silent or late. */
int verdict_report(const tally_t *tally);

#endif
