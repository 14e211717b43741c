/* SPDX-License-Identifier: Apache-2.0 */
#include "verdict.h"

#include <math.h>
#include <stdbool.h>
#include <stdio.h>

#define APART_NM 5.0
#define TIME_MS 50U

static const char *const verdict_names[VERDICTS] = {"masked", "early",  "in time", "passed",
                                                    "late",   "silent", "stopped"};

/* The millisecond in which the torques are first apart, and for how many they are, up to a fault. */
static uint32_t first_apart(const trace_t *golden, const trace_t *trace, uint32_t *milliseconds, double *largest_Nm)
{
    const uint32_t end = (trace->fault_ms == NO_FAULT) ? trace->ms : trace->fault_ms;
    uint32_t first = NO_FAULT;
    *milliseconds = 0;
    *largest_Nm = 0.0;
    for (uint32_t ms = 0; ms < end; ms++) {
        const double apart_Nm = fabs(trace->shaft_Nm[ms] - golden->shaft_Nm[ms]);
        if (apart_Nm > APART_NM) {
            first = (first == NO_FAULT) ? ms : first;
            (*milliseconds)++;
        }
        *largest_Nm = fmax(*largest_Nm, apart_Nm);
    }
    return first;
}

static verdict_t verdict(const trace_t *trace, uint32_t first, uint32_t apart_ms)
{
    const bool faulted = trace->fault_ms != NO_FAULT;
    if (trace->ended != 0) {
        return STOPPED;
    }
    if (first == NO_FAULT) {
        return faulted ? EARLY : MASKED;
    }
    if (!faulted) {
        return (apart_ms <= TIME_MS) ? PASSED : SILENT;
    }
    return (trace->fault_ms - first <= TIME_MS) ? IN_TIME : LATE;
}

void classify(tally_t *tally, const trace_t *golden, const trace_t *trace, const place_t *place, double rpm)
{
    uint32_t apart_ms;
    double largest_Nm;
    const uint32_t first = first_apart(golden, trace, &apart_ms, &largest_Nm);
    const verdict_t v = verdict(trace, first, apart_ms);
    const unsigned block = memory_block(place->byte);
    tally->count[block][v]++;
    if (v == PASSED && apart_ms > tally->longest_passed_ms) {
        tally->longest_passed_ms = apart_ms;
    }
    if (v == IN_TIME && trace->fault_ms - first > tally->longest_in_time_ms) {
        tally->longest_in_time_ms = trace->fault_ms - first;
    }
    if (v == SILENT || v == LATE || v == PASSED) {
        printf("%-7s %s + %u, bit %u, at %.0f rpm: %u ms apart, at most %.1f N·m, faults 0x%X\n", verdict_names[v],
               memory_block_name(block), (unsigned)(place->byte - memory_block_offset(block)), (unsigned)place->bit,
               rpm, (unsigned)apart_ms, largest_Nm, (unsigned)trace->faults);
    }
}

int verdict_report(const tally_t *tally)
{
    unsigned sum[VERDICTS] = {0};
    printf("%-32s", "block");
    for (unsigned v = 0; v < VERDICTS; v++) {
        printf(" %8s", verdict_names[v]);
    }
    for (unsigned block = 0; memory_block_name(block) != NULL; block++) {
        printf("\n%-32s", memory_block_name(block));
        for (unsigned v = 0; v < VERDICTS; v++) {
            printf(" %8u", tally->count[block][v]);
            sum[v] += tally->count[block][v];
        }
    }
    printf("\n%-32s", "all");
    for (unsigned v = 0; v < VERDICTS; v++) {
        printf(" %8u", sum[v]);
    }
    printf("\nlongest: %u ms until a fault, %u ms until it had passed\n", tally->longest_in_time_ms,
           tally->longest_passed_ms);
    return (sum[SILENT] + sum[LATE] == 0U) ? 0 : 1;
}
