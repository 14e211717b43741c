/* SPDX-License-Identifier: Apache-2.0 */
#ifndef EMULATOR_PREEMPT_H
#define EMULATOR_PREEMPT_H
/** Interrupts one activity (the victim) at each of its instructions by the fast ISR, and by the identification that it
 * pends, and checks that no activity reads a half-written value. The same firmware on the host computes the only
 * allowed outcomes, bit for bit:
 *   the victim   finds everything as it was when it was entered, or everything as the interrupts have left it;
 *                the latter only if it had handed nothing over before
 *   the ISRs     find each result that the victim hands over (a word, or a box by its generation) as it was, or as the
 *                victim writes it without interruption
 * Every other outcome is mixed: a value of which a part is old and a part is new, or an old and a new value that do not
 * belong together.
 * Source   docs/architecture.md, shared data
 * Errors   preempt_run(): a negative number, and the reason in the report
 * Context  a test, in counting mode, with the image in which nothing but the drive runs in the 1 kHz task; the
 *          simulation is left as it was */
#include "emu.h"
#include "loop/runner/sim.h"

typedef enum { PREEMPT_MRAI = 16 + 69, PREEMPT_TASK = 16 + 48 } preempt_victim_t;

typedef struct {
    int instructions; /* of the victim, uninterrupted */
    int points;       /* boundaries tried */
    int mixed;        /* outcomes that are not allowed */
    int outcomes;     /* of the victim's two, how many were seen */
    int choices;      /* combinations of old and new results of the victim that the interrupts have found */
    char first[160];  /* the first mixed outcome, or why nothing could be tried */
} preempt_report_t;

/** rounds: fast ISRs at the same boundary, 1 or 2 (the task only): two overwrite the slot that is being copied. */
EMU_API int preempt_run(sim_t *sim, int victim, int rounds, preempt_report_t *report);

#endif
