/* SPDX-License-Identifier: Apache-2.0 */
#ifndef EMULATOR_PREEMPT_H
#define EMULATOR_PREEMPT_H
/** Interrupts one activity at every instruction by the fast ISR (and the identification that it pends), and asks
 * whether the activity saw each shared value either as it was or as it became. The same firmware on the host computes
 * what is allowed: every combination of old and new among the words that make a difference, and among the boxes of
 * samples and windows. Needs counting mode and the image in which nothing but the drive runs in the 1 kHz task.
 * Source   docs/architecture.md, shared data
 * Errors   preempt_run(): a negative number, and why in the report
 * Context  a test; the simulation is left as it was */
#include "emu.h"
#include "loop/runner/sim.h"

typedef enum { PREEMPT_MRAI = 16 + 69, PREEMPT_TASK = 16 + 48 } preempt_victim_t;

typedef struct {
    int instructions;  /* of the victim, uninterrupted */
    int points;        /* boundaries tried */
    int mixed;         /* outcomes that no combination explains */
    int outcomes;      /* different allowed outcomes that were seen */
    int words;         /* shared words, besides the sample box, that make a difference */
    char first[160];   /* the first mixed outcome, or why nothing could be tried */
} preempt_report_t;

/** rounds: fast ISRs at the same boundary, 1 or 2. */
EMU_API int preempt_run(sim_t *sim, int victim, int rounds, preempt_report_t *report);

#endif
