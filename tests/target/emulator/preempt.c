/* SPDX-License-Identifier: Apache-2.0 */
#include "preempt.h"

#include <stdio.h>
#include <string.h>

#include "emulated_private.h"
#include "hal/host/port.h"
#include "loop/runner/sim_private.h"

enum { FAST_VECTOR = 16 + 39, MRAI_VECTOR = 16 + 69 };
enum { WORDS_MAX = 12, OUTCOMES_MAX = 1 << (WORDS_MAX + 2), POINTS_MAX = 8000 };
enum { PERIODS_TO_FIND = 25, ENCODER_SHIFT = 18 };

typedef struct {
    emulated_t *e;
    int victim;
    bool catch_entry, catch_exit, catch_return; /* what emu_run() is to stop at */
    fluxtrue_t *host;
    drive_t before, after;                /* the victim's inputs, old and new */
    size_t word[WORDS_MAX];               /* offsets in drive_t of the words that make a difference */
    int words;
    drive_t outcome[OUTCOMES_MAX];
    bool seen[OUTCOMES_MAX];
    int outcomes;
    fast_state_t fast[4];                 /* what the fast ISR may make of the identification's two words */
} preempt_t;

/* Too large for a stack; a test runs one at a time. */
static preempt_t the_test;

/* ---- the emulated side ---- */

static void on_exception(void *user, int vector, bool entered)
{
    preempt_t *p = user;
    const bool hit = (p->catch_entry && entered && vector == p->victim) ||
                     (p->catch_exit && !entered && vector == p->victim) ||
                     (p->catch_return && !entered && vector == MRAI_VECTOR &&
                      emu_active_vector(p->e->emu) == p->victim);
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

static drive_t drive_there(preempt_t *p)
{
    p->e->mirror.pulled_at = UINT64_MAX;
    mirror_pull(&p->e->mirror);
    return p->e->mirror.host->drive;
}

/* Another sample than the last: the currents have moved. The shaft stands where the encoder was read last, because
 * what the image takes away for the time since the sample would depend on when it is interrupted. */
static void next_sample(preempt_t *p, int round)
{
    static const char *const results[4] = {"ADC0.R0", "ADC1.R0", "ADC0.R1", "ADC1.R1"};
    static const int change[4] = {40, -25, -15, 7};
    for (int i = 0; i < 4; i++) {
        const uint32_t old = (uint32_t)emu_register(p->e->emu, results[i]);
        (void)emu_register_set(p->e->emu, results[i], old + (uint32_t)(change[i] * (round + 1)));
    }
    emu_pins_t *pins = emu_pins(p->e->emu);
    pins->angle = emu_counter_read(p->e->emu, 1, false) << ENCODER_SHIFT;
    pins->angle_rate = 0;
}

static void round_there(preempt_t *p, int round)
{
    next_sample(p, round);
    emu_pend(p->e->emu, FAST_VECTOR);
}

/* ---- the same on the host ---- */

static void fast_here(preempt_t *p, drive_t *drive)
{
    p->host->drive = *drive;
    p->host->drive.motor = p->e->mirror.host->drive.motor;
    p->host->counts = (adc_counts_t){.i_a = (uint16_t)emu_register(p->e->emu, "ADC0.R0"),
                                     .i_b = (uint16_t)emu_register(p->e->emu, "ADC1.R0"),
                                     .i_c = (uint16_t)emu_register(p->e->emu, "ADC0.R1"),
                                     .v_dc = (uint16_t)emu_register(p->e->emu, "ADC1.R1")};
    p->host->theta_m = emu_pins_look(p->e->emu)->angle;
    host_port_select(p->host);
    fast_isr(&p->host->drive);
    host_port_select(NULL);
    *drive = p->host->drive;
}

static drive_t victim_here(preempt_t *p, const drive_t *inputs)
{
    p->host->drive = *inputs;
    p->host->drive.motor = p->e->mirror.host->drive.motor;
    temperatures_take(p->e, p->host);
    host_port_select(p->host);
    if (p->victim == PREEMPT_MRAI) {
        mrai_isr(&p->host->drive);
    } else {
        task_1khz(&p->host->drive);
    }
    host_port_select(NULL);
    return drive_plain(&p->host->drive);
}

/* What the victim alone writes; for the identification without its count of finished periods, a word of its own. */
static bool same_outputs(const preempt_t *p, const drive_t *a, const drive_t *b)
{
    if (p->victim == PREEMPT_TASK) {
        return memcmp(&a->task, &b->task, sizeof a->task) == 0 &&
               memcmp(&a->commands, &b->commands, sizeof a->commands) == 0 &&
               memcmp(&a->schedules, &b->schedules, sizeof a->schedules) == 0;
    }
    slow_state_t x = a->slow, y = b->slow;
    x.finished = y.finished = 0;
    return memcmp(&x, &y, sizeof x) == 0;
}

/* Takes a word from the new state. */
static void word_new(const preempt_t *p, drive_t *drive, size_t offset)
{
    memcpy((uint8_t *)drive + offset, (const uint8_t *)&p->after + offset, 4);
}

static bool matters(preempt_t *p, size_t offset)
{
    drive_t from_old = p->before, from_new = p->after;
    word_new(p, &from_old, offset);
    memcpy((uint8_t *)&from_new + offset, (const uint8_t *)&p->before + offset, 4);
    const drive_t old = victim_here(p, &p->before), old_toggled = victim_here(p, &from_old);
    const drive_t new = victim_here(p, &p->after), new_toggled = victim_here(p, &from_new);
    return !same_outputs(p, &old, &old_toggled) || !same_outputs(p, &new, &new_toggled);
}

/* The words of fast and slow state that changed and that the victim reads; its own are not shared. */
static bool words_find(preempt_t *p)
{
    const size_t first = offsetof(drive_t, fast), last = offsetof(drive_t, task);
    for (size_t at = first; at < last; at += 4) {
        const bool own = p->victim == PREEMPT_MRAI && at >= offsetof(drive_t, slow);
        const bool changed = memcmp((uint8_t *)&p->before + at, (uint8_t *)&p->after + at, 4) != 0;
        if (!own && changed && matters(p, at)) {
            if (p->words == WORDS_MAX) {
                return false;
            }
            p->word[p->words++] = at;
        }
    }
    return true;
}

static void outcomes_compute(preempt_t *p)
{
    for (int choice = 0; choice < 1 << (p->words + 2); choice++) {
        drive_t inputs = p->before;
        if ((choice & 1) != 0) {
            inputs.samples = p->after.samples;
        }
        if ((choice & 2) != 0 && p->victim == PREEMPT_TASK) {
            inputs.windows = p->after.windows;
        }
        for (int i = 0; i < p->words; i++) {
            if ((choice >> (i + 2) & 1) != 0) {
                word_new(p, &inputs, p->word[i]);
            }
        }
        p->outcome[p->outcomes++] = victim_here(p, &inputs);
    }
}

/* The fast ISR reads two words of the identification: its correction, and how many periods it has finished. */
static void fast_outcomes_compute(preempt_t *p)
{
    const drive_t done = victim_here(p, &p->before);
    for (int choice = 0; choice < 4; choice++) {
        drive_t drive = p->before;
        if ((choice & 1) != 0) {
            drive.slow.psi_delta_q15 = done.slow.psi_delta_q15;
        }
        if ((choice & 2) != 0) {
            drive.slow.finished = done.slow.finished;
        }
        fast_here(p, &drive);
        p->fast[choice] = drive_plain(&drive).fast;
    }
}

static bool fast_explained(const preempt_t *p, const drive_t *there)
{
    bool explained = p->victim == PREEMPT_TASK;
    for (int i = 0; i < 4; i++) {
        explained = explained || memcmp(&there->fast, &p->fast[i], sizeof p->fast[i]) == 0;
    }
    return explained;
}

/* Old and new inputs, as the host computes them from the state at the victim's entry. */
static void inputs_compute(preempt_t *p, int rounds)
{
    p->before = drive_there(p);
    p->after = p->before;
    for (int round = 0; round < rounds; round++) {
        next_sample(p, round);
        fast_here(p, &p->after);
        if (p->victim == PREEMPT_TASK) {
            mrai_isr(&p->after);
        }
    }
}

/* ---- one boundary ---- */

/* False: the victim had finished before so many instructions. */
static bool interrupted_after(preempt_t *p, const emu_snapshot_t *start, uint64_t n, int rounds)
{
    emu_restore(p->e->emu, start);
    emu_break_after(p->e->emu, n);
    if (!run_to_break(p) || emu_active_vector(p->e->emu) != p->victim) {
        return false;
    }
    for (int round = 0; round < rounds; round++) {
        p->catch_return = round + 1 < rounds;
        round_there(p, round);
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

static void judge(preempt_t *p, preempt_report_t *report, int n)
{
    const drive_t there = drive_there(p), plain = drive_plain(&there);
    report->points++;
    for (int i = 0; i < p->outcomes; i++) {
        if (same_outputs(p, &plain, &p->outcome[i]) && fast_explained(p, &plain)) {
            p->seen[i] = true;
            return;
        }
    }
    if (report->mixed++ == 0) {
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

static int try_all(preempt_t *p, int rounds, preempt_report_t *report)
{
    p->catch_entry = true;
    const bool found = run_to_break(p);
    p->catch_entry = false;
    if (!found) {
        (void)snprintf(report->first, sizeof report->first, "vector %d was never entered", p->victim);
        return -1;
    }
    emu_snapshot_t *start = emu_save(p->e->emu);
    inputs_compute(p, rounds);
    const bool fits = words_find(p);
    if (fits) {
        outcomes_compute(p);
        fast_outcomes_compute(p);
        report->instructions = length_of(p, start);
        for (int n = 0; n < report->instructions && n < POINTS_MAX; n++) {
            if (interrupted_after(p, start, (uint64_t)n, rounds)) {
                judge(p, report, n);
            }
        }
    }
    emu_snapshot_free(start);
    (void)(fits || snprintf(report->first, sizeof report->first, "more than %d shared words", WORDS_MAX));
    return fits ? 0 : -1;
}

int preempt_run(sim_t *sim, int victim, int rounds, preempt_report_t *report)
{
    preempt_t *p = &the_test;
    memset(p, 0, sizeof *p);
    memset(report, 0, sizeof *report);
    p->e = sim->controller.self;
    p->victim = victim;
    p->host = fluxtrue_create();
    emu_snapshot_t *as_it_was = emu_save(p->e->emu);
    emu_on_exception(p->e->emu, on_exception, p);
    const int code = p->host != NULL ? try_all(p, rounds, report) : -1;
    emu_on_exception(p->e->emu, NULL, NULL);
    emu_restore(p->e->emu, as_it_was);
    emu_snapshot_free(as_it_was);
    fluxtrue_destroy(p->host);
    report->words = p->words;
    for (int i = 0; i < p->outcomes; i++) {
        report->outcomes += p->seen[i];
    }
    return code;
}
