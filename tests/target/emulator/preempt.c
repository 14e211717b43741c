/* SPDX-License-Identifier: Apache-2.0 */
#include "preempt.h"

#include <stddef.h>
#include <stdio.h>
#include <string.h>

#include "emulated_private.h"
#include "hal/host/port.h"
#include "loop/runner/sim_private.h"

enum { FAST_VECTOR = 16 + 39, MRAI_VECTOR = 16 + 69 };
enum { OLD, NEW, OUTCOMES };
enum { CHOICES_MAX = 16, POINTS_MAX = 12000 };
enum { PERIODS_TO_FIND = 25, ENCODER_SHIFT = 18 };

typedef struct {
    emulated_t *e;
    int victim, rounds;
    int last_vector;                            /* last handler of a round: the identification's if it was pended */
    bool catch_entry, catch_exit, catch_return; /* the events at which emu_run() must stop */
    fluxtrue_t *host;
    adc_counts_t counts;             /* of the last sample at the victim's entry */
    drive_t before;                  /* at the victim's entry */
    drive_t outcome[OUTCOMES];       /* of the victim */
    drive_t interrupts[CHOICES_MAX]; /* after the interrupts, for each set of results that were handed over before */
    int choices;
    bool seen[OUTCOMES], chosen[CHOICES_MAX];
} preempt_t;

/* Too large for a stack; a test runs one at a time. */
static preempt_t the_test;

/* ---- the emulated side ---- */

static void on_exception(void *user, int vector, bool entered)
{
    preempt_t *p = user;
    const bool hit =
        (p->catch_entry && entered && vector == p->victim) || (p->catch_exit && !entered && vector == p->victim) ||
        (p->catch_return && !entered && vector == p->last_vector && emu_active_vector(p->e->emu) == p->victim);
    if (hit) {
        emu_break_after(p->e->emu, 0);
    }
}

static bool run_to_break(preempt_t *p)
{
    for (int i = 0; i < PERIODS_TO_FIND; i++) {
        const int stopped = emu_run(p->e->emu, (uint64_t)p->e->period_ticks);
        if (stopped == EMU_BREAK) {
            return true;
        }
        if (stopped == EMU_FAILED) {
            return false;
        }
    }
    return false;
}

static drive_t image_drive(preempt_t *p)
{
    p->e->mirror.pulled_at = UINT64_MAX;
    mirror_pull(&p->e->mirror);
    return p->e->mirror.host->drive;
}

/* A sample that differs from the last one in its currents. The shaft stands at the angle that was read last: otherwise
 * the image would correct the angle for the time since the sample, which depends on where it is interrupted. */
static adc_counts_t sample_of(const preempt_t *p, int round)
{
    const adc_counts_t *c = &p->counts;
    const uint32_t more = (uint32_t)round + 1U;
    return (adc_counts_t){.i_a = c->i_a + 40U * more,
                          .i_b = c->i_b - 25U * more,
                          .i_c = c->i_c - 15U * more,
                          .v_dc = c->v_dc + 7U * more};
}

static uint32_t shaft(const preempt_t *p)
{
    return emu_counter_read(p->e->emu, 1, false) << ENCODER_SHIFT;
}

static void interrupt_image(preempt_t *p, int round)
{
    const adc_counts_t counts = sample_of(p, round);
    (void)emu_register_set(p->e->emu, "ADC0.R0", counts.i_a);
    (void)emu_register_set(p->e->emu, "ADC1.R0", counts.i_b);
    (void)emu_register_set(p->e->emu, "ADC0.R1", counts.i_c);
    (void)emu_register_set(p->e->emu, "ADC1.R1", counts.v_dc);
    emu_pins_t *pins = emu_pins(p->e->emu);
    pins->angle = shaft(p);
    pins->angle_rate = 0;
    emu_pend(p->e->emu, FAST_VECTOR);
}

/* ---- the same on the host ---- */

static void load(preempt_t *p, const drive_t *drive)
{
    p->host->drive = *drive;
    p->host->drive.motor = p->e->mirror.host->drive.motor;
    p->host->drive.period = p->e->mirror.host->drive.period;
    p->host->drive.parameters = p->e->mirror.host->drive.parameters;
    p->host->drive.data_check = p->e->mirror.host->drive.data_check;
    temperatures_take(p->e, p->host);
    emu_bridge_t bridge;
    emu_bridge(p->e->emu, &bridge);
    p->host->gates = bridge.gates; /* the task reads them back */
    host_port_select(p->host);
}

static drive_t unload(preempt_t *p)
{
    host_port_select(NULL);
    return drive_plain(&p->host->drive);
}

/* The interrupts that come at one boundary; the identification's does not interrupt itself. */
static drive_t interrupts_on_host(preempt_t *p, const drive_t *drive)
{
    load(p, drive);
    p->host->theta_m = shaft(p);
    for (int round = 0; round < p->rounds; round++) {
        p->host->counts = sample_of(p, round);
        fast_isr(&p->host->drive);
        if (p->victim == PREEMPT_TASK && p->host->mrai_pending) {
            mrai_isr(&p->host->drive);
        }
        p->last_vector = p->host->mrai_pending ? MRAI_VECTOR : FAST_VECTOR;
        p->host->mrai_pending = false;
    }
    return unload(p);
}

static drive_t victim_on_host(preempt_t *p, const drive_t *inputs)
{
    load(p, inputs);
    if (p->victim == PREEMPT_MRAI) {
        mrai_isr(&p->host->drive);
    } else {
        task_1khz(&p->host->drive);
    }
    return unload(p);
}

#define PART(name) {offsetof(drive_t, name), sizeof(((drive_t *)0)->name)}

typedef struct {
    size_t offset, size;
} part_t;

/* The results that a victim hands over to the interrupts: each is one word, or a box whose generation is one word. */
static const part_t by_mrai[] = {PART(psi_d_error), PART(mrai.isr.finished)};
static const part_t by_task[] = {PART(commands), PART(mrai.schedules), PART(task.psi_d_error),
                                 PART(task.angle_correction)};

/* The drive as the interrupts find it after the victim has handed over some of its results: one bit of choice each. */
static drive_t handed_over(const preempt_t *p, int choice)
{
    const part_t *part = p->victim == PREEMPT_MRAI ? by_mrai : by_task;
    drive_t drive = p->before;
    for (; choice != 0; choice >>= 1, part++) {
        if ((choice & 1) != 0) {
            memcpy((uint8_t *)&drive + part->offset, (const uint8_t *)&p->outcome[OLD] + part->offset, part->size);
        }
    }
    return drive;
}

/* Computes the allowed outcomes: the victim finds everything as it was when it was entered, or everything as the
 * interrupts have left it. */
static void allowed_compute(preempt_t *p)
{
    p->outcome[OLD] = victim_on_host(p, &p->before);
    drive_t after = interrupts_on_host(p, &p->before);
    if (p->victim == PREEMPT_MRAI) {
        /* Of what the interrupts write, only the mailbox and the ring of the samples are inputs of this victim. */
        after.mrai.isr = p->before.mrai.isr;
        after.psi_d_error = p->before.psi_d_error;
        after.fast = p->before.fast;
    }
    p->outcome[NEW] = victim_on_host(p, &after);
    p->choices = p->victim == PREEMPT_MRAI ? 4 : 16;
    for (int choice = 0; choice < p->choices; choice++) {
        const drive_t drive = handed_over(p, choice);
        p->interrupts[choice] = interrupts_on_host(p, &drive);
    }
}

/* ---- one boundary ---- */

// NOLINTBEGIN(bugprone-suspicious-memory-comparison,cert-exp42-c,cert-flp37-c): mirror.c has cleared the padding

/* Compares what only the victim writes. The identification's count of finished periods is left out, because it counts
 * the period for which it was pended, whichever sample it found. */
static bool same_victim(const preempt_t *p, const drive_t *a, const drive_t *b)
{
    if (p->victim == PREEMPT_TASK) {
        return memcmp(&a->task, &b->task, sizeof a->task) == 0 &&
               memcmp(&a->commands, &b->commands, sizeof a->commands) == 0 &&
               memcmp(&a->mrai.schedules, &b->mrai.schedules, sizeof a->mrai.schedules) == 0 &&
               memcmp(&a->mrai.task, &b->mrai.task, sizeof a->mrai.task) == 0;
    }
    mrai_isr_state_t x = a->mrai.isr, y = b->mrai.isr;
    x.finished = y.finished = 0;
    return memcmp(&x, &y, sizeof x) == 0;
}

static bool same_interrupts(const preempt_t *p, const drive_t *a, const drive_t *b)
{
    const bool fast = memcmp(&a->fast, &b->fast, sizeof a->fast) == 0 &&
                      memcmp(&a->samples, &b->samples, sizeof a->samples) == 0 &&
                      memcmp(&a->windows, &b->windows, sizeof a->windows) == 0 &&
                      memcmp(&a->mrai.mailbox, &b->mrai.mailbox, sizeof a->mrai.mailbox) == 0;
    const bool law = a->psi_d_error == b->psi_d_error && memcmp(&a->mrai.isr, &b->mrai.isr, sizeof a->mrai.isr) == 0;
    return fast && (p->victim == PREEMPT_MRAI || law);
}

// NOLINTEND(bugprone-suspicious-memory-comparison,cert-exp42-c,cert-flp37-c)

/* False: the victim had finished before this number of instructions. */
static bool interrupted_after(preempt_t *p, const emu_snapshot_t *start, uint64_t n)
{
    emu_restore(p->e->emu, start);
    emu_break_after(p->e->emu, n);
    if (!run_to_break(p) || emu_active_vector(p->e->emu) != p->victim) {
        return false;
    }
    for (int round = 0; round < p->rounds; round++) {
        p->catch_return = round + 1 < p->rounds;
        interrupt_image(p, round);
        if (p->catch_return && !run_to_break(p)) {
            return false;
        }
    }
    p->catch_return = false;
    p->catch_exit = true;
    const bool ended = run_to_break(p);
    p->catch_exit = false;
    return ended;
}

/* A victim that reads its inputs after the interrupts has handed over nothing before them: then only choice 0 is
 * allowed. */
static bool is_allowed(preempt_t *p, const drive_t *image)
{
    for (int outcome = OLD; outcome < OUTCOMES; outcome++) {
        const int choices = outcome == NEW ? 1 : p->choices;
        for (int choice = 0; choice < choices; choice++) {
            if (same_victim(p, image, &p->outcome[outcome]) && same_interrupts(p, image, &p->interrupts[choice])) {
                p->seen[outcome] = true;
                p->chosen[choice] = true;
                return true;
            }
        }
    }
    return false;
}

static void classify_outcome(preempt_t *p, preempt_report_t *report, int n)
{
    const drive_t drive = image_drive(p), plain = drive_plain(&drive);
    report->points++;
    if (!is_allowed(p, &plain) && report->mixed++ == 0) {
        (void)snprintf(report->first, sizeof report->first, "interrupted after %d instructions", n);
    }
}

static int length_of(preempt_t *p, const emu_snapshot_t *start)
{
    emu_restore(p->e->emu, start);
    const uint64_t from = emu_instructions(p->e->emu);
    p->catch_exit = true;
    const bool ended = run_to_break(p);
    p->catch_exit = false;
    return ended ? (int)(emu_instructions(p->e->emu) - from) : -1;
}

/* When the task is entered, a window has just been handed over; the next would be complete N periods later. Here the
 * next period completes it, so that the first interrupt hands it over, wherever the task is interrupted. */
static void complete_window_next(preempt_t *p)
{
    const uint32_t step_end = image_drive(p).samples.generation + 1U;
    const mirror_t *m = &p->e->mirror;
    for (int i = m->inputs; i < m->parts; i++) {
        if (m->part[i].host_offset == offsetof(drive_t, fast)) {
            const size_t inside = offsetof(drive_t, fast.step_end) - offsetof(drive_t, fast);
            (void)emu_write(p->e->emu, m->base + m->part[i].image_offset + (uint32_t)inside, &step_end,
                            sizeof step_end);
        }
    }
}

static int try_all(preempt_t *p, preempt_report_t *report)
{
    p->catch_entry = true;
    const bool found = run_to_break(p);
    p->catch_entry = false;
    if (!found) {
        (void)snprintf(report->first, sizeof report->first, "vector %d was never entered", p->victim);
        return -1;
    }
    (void)emu_register_set(p->e->emu, "PDB0.SC", 0); /* no conversions: only this test starts fast ISRs */
    (void)emu_register_set(p->e->emu, "PDB1.SC", 0);
    complete_window_next(p);
    emu_snapshot_t *start = emu_save(p->e->emu);
    p->before = image_drive(p);
    p->counts = (adc_counts_t){.i_a = (uint16_t)emu_register(p->e->emu, "ADC0.R0"),
                               .i_b = (uint16_t)emu_register(p->e->emu, "ADC1.R0"),
                               .i_c = (uint16_t)emu_register(p->e->emu, "ADC0.R1"),
                               .v_dc = (uint16_t)emu_register(p->e->emu, "ADC1.R1")};
    allowed_compute(p);
    report->instructions = length_of(p, start);
    for (int n = 0; n < report->instructions && n < POINTS_MAX; n++) {
        if (interrupted_after(p, start, (uint64_t)n)) {
            classify_outcome(p, report, n);
        }
    }
    emu_snapshot_free(start);
    return 0;
}

int preempt_run(sim_t *sim, int victim, int rounds, preempt_report_t *report)
{
    preempt_t *p = &the_test;
    memset(p, 0, sizeof *p);
    memset(report, 0, sizeof *report);
    p->e = sim->controller.self;
    p->victim = victim;
    p->rounds = rounds;
    p->host = fluxtrue_create();
    emu_snapshot_t *initial = emu_save(p->e->emu);
    emu_on_exception(p->e->emu, on_exception, p);
    const int code = p->host != NULL ? try_all(p, report) : -1;
    emu_on_exception(p->e->emu, NULL, NULL);
    emu_restore(p->e->emu, initial);
    emu_snapshot_free(initial);
    fluxtrue_destroy(p->host);
    report->outcomes = p->seen[OLD] + p->seen[NEW];
    for (int i = 0; i < p->choices; i++) {
        report->choices += p->chosen[i];
    }
    return code;
}
