/* SPDX-License-Identifier: Apache-2.0 */
/* Exceptions: pending state, priorities, entry and return. Every active exception has its frame on the stack; registers
 * of the floating-point unit are stacked at once, never lazily.
 *
 * documented behaviour                             | modelled | test
 * ------------------------------------------------ | -------- | --------------------------------------------
 * priorities, groups, nesting, PRIMASK, BASEPRI    | yes      | test_qemu_takes_the_same_exceptions
 * pended while masked: taken when unmasked         | yes      | test_qemu_takes_the_same_exceptions
 * stacking, alignment, floating-point registers    | yes      | test_exceptions_nest_by_priority
 * an active level pends again after the return     | yes      | test_a_level_that_stays_active_interrupts_again
 * pending stays although the level has gone        | yes      | test_a_read_before_the_interrupt_loses_no_period
 * sleep, wake-up                                   | yes      | test_a_sleeping_core_is_woken_by_each_tick
 * a vector without a handler                       | refused  | test_what_is_not_modelled_is_an_error
 * MPU                                              | refused  | test_what_is_not_modelled_is_an_error
 * faults as exceptions: faults.c                   | yes      | test_a_core_fault_is_an_exception
 * an interrupt within an IT block: taken after it  | yes      | test_an_interrupt_at_any_instruction_changes_no_result
 * lazy stacking, tail-chaining, late arrival       | no       | -
 */
#include <string.h>

#include "emu_private.h"

enum {
    NMI = 2,
    HARD_FAULT = 3,
    MEMORY_FAULT = 4,
    SYSTICK = 15,
    FRAME_WORDS = 8,
    EXTENDED_WORDS = 26,
    STANDARD_FRAME = 0x10, /* in EXC_RETURN */
    FPCA = 4,
    SPSEL = 2,
    SFPA = 8, /* unicorn's core implements it; without it the context counts as a new one, and FPSCR would be lost */
    LOWEST = 256,
    XPSR_ALIGNED = 1 << 9,
    XPSR_VECTOR = 0x1FF,
    STKERR = 1 << 12, /* of CFSR */
    FORCED = 1 << 30, /* of HFSR */
    LOCK_UP = 0x200,  /* of RCM_SRS */
};

static const int frame_registers[FRAME_WORDS] = {UC_ARM_REG_R0,  UC_ARM_REG_R1, UC_ARM_REG_R2, UC_ARM_REG_R3,
                                                 UC_ARM_REG_R12, UC_ARM_REG_LR, UC_ARM_REG_PC, UC_ARM_REG_XPSR};

static uint32_t get(const emu_t *emu, int reg)
{
    uint32_t value = 0;
    (void)uc_reg_read(emu->uc, reg, &value);
    return value;
}

static void put(emu_t *emu, int reg, uint32_t value)
{
    (void)uc_reg_write(emu->uc, reg, &value);
}

void nvic_reset(emu_t *emu)
{
    nvic_t *n = &emu->s.nvic;
    memset(n, 0, sizeof *n);
    n->ccr = 1U << 9;    /* STKALIGN */
    n->fpccr = 3U << 30; /* ASPEN, LSPEN */
    n->aircr = 0xFA050000U;
}

static bool bit(const uint32_t *set, int vector)
{
    return (set[vector / 32] >> (vector % 32) & 1U) != 0;
}

static void bit_set(uint32_t *set, int vector, bool on)
{
    const uint32_t mask = 1U << (vector % 32);
    set[vector / 32] = on ? set[vector / 32] | mask : set[vector / 32] & ~mask;
}

/* Group priority: the priority without the bits below AIRCR.PRIGROUP, which do not preempt. */
static int priority_of(const nvic_t *n, int vector)
{
    if (vector == NMI || vector == HARD_FAULT) {
        return vector == NMI ? -2 : -1;
    }
    return n->priority[vector] & (0xFF & (0xFE << (n->aircr >> 8 & 7U)));
}

static bool enabled(const nvic_t *n, int vector)
{
    return vector < 16 || bit(n->enabled, vector);
}

/* Group priority and subpriority, which orders the pending exceptions of one group. */
static int whole_priority(const nvic_t *n, int vector)
{
    return vector == NMI || vector == HARD_FAULT ? priority_of(n, vector) : n->priority[vector];
}

/* The pending exception of the highest priority; -1: none. */
static int first_pending(const nvic_t *n)
{
    int best = -1, best_priority = LOWEST;
    for (int word = 0; word < VECTOR_WORDS; word++) {
        uint32_t left = n->pending[word];
        while (left != 0) {
            const int vector = 32 * word + __builtin_ctz(left);
            left &= left - 1U;
            if (enabled(n, vector) && (best < 0 || whole_priority(n, vector) < best_priority)) {
                best = vector;
                best_priority = whole_priority(n, vector);
            }
        }
    }
    return best;
}

static int active_priority(const nvic_t *n)
{
    int lowest = LOWEST;
    for (uint32_t i = 0; i < n->nest; i++) {
        const int priority = priority_of(n, n->active[i]);
        lowest = priority < lowest ? priority : lowest;
    }
    return lowest;
}

static int masked_priority(const emu_t *emu, int priority)
{
    const int basepri = (int)(get(emu, UC_ARM_REG_BASEPRI) & 0xF0U);
    if ((get(emu, UC_ARM_REG_FAULTMASK) & 1U) != 0) {
        return priority < -1 ? priority : -1;
    }
    if ((get(emu, UC_ARM_REG_PRIMASK) & 1U) != 0) {
        return priority < 0 ? priority : 0;
    }
    return basepri != 0 && basepri < priority ? basepri : priority;
}

/* The exception that may be taken now; -1: none. */
int nvic_best(const emu_t *emu)
{
    const int vector = first_pending(&emu->s.nvic);
    if (vector < 0) {
        return -1;
    }
    const int priority = priority_of(&emu->s.nvic, vector), current = active_priority(&emu->s.nvic);
    return priority < current && priority < masked_priority(emu, current) ? vector : -1;
}

/* A pending exception of higher priority than the running code is taken at once. While it is masked, nvic_take() lets
 * the core poll the masks, so that it is taken as soon as it is unmasked. */
void nvic_reconsider(emu_t *emu)
{
    const int vector = first_pending(&emu->s.nvic);
    if (vector >= 0 && priority_of(&emu->s.nvic, vector) < active_priority(&emu->s.nvic)) {
        emu->s.reschedule = true;
    }
}

void nvic_pend(emu_t *emu, int vector)
{
    bit_set(emu->s.nvic.pending, vector, true);
    nvic_reconsider(emu);
}

void nvic_line(emu_t *emu, int irq, bool level)
{
    const int vector = 16 + irq;
    if (level && !bit(emu->s.nvic.line, vector)) {
        nvic_pend(emu, vector);
    }
    bit_set(emu->s.nvic.line, vector, level);
}

static uint32_t words_of(uint32_t exc_return)
{
    return (exc_return & STANDARD_FRAME) == 0U ? EXTENDED_WORDS : FRAME_WORDS;
}

static bool stack_write(emu_t *emu, uint32_t address, const uint32_t *words, uint32_t count)
{
    if (emu_memory_write(emu, address, words, 4U * count)) {
        return true;
    }
    if (emu->takes_faults) {
        emu->s.nvic.cfsr |= STKERR;
        return false;
    }
    emu_fail(emu, "the stack is outside the memory: exception frame at 0x%08x", address);
    return false;
}

/* The value of EXC_RETURN; stored: whether there was memory for the frame. */
static uint32_t push_frame(emu_t *emu, bool *stored)
{
    uint32_t frame[EXTENDED_WORDS] = {0};
    const bool extended = (get(emu, UC_ARM_REG_CONTROL) & FPCA) != 0;
    const uint32_t words = extended ? EXTENDED_WORDS : FRAME_WORDS;
    for (int i = 0; i < FRAME_WORDS; i++) {
        frame[i] = get(emu, frame_registers[i]);
    }
    frame[6] = emu->s.pc;
    for (int i = 0; extended && i < 16; i++) {
        frame[FRAME_WORDS + i] = get(emu, UC_ARM_REG_S0 + i);
    }
    frame[24] = extended ? get(emu, UC_ARM_REG_FPSCR) : 0U;
    const uint32_t sp = get(emu, UC_ARM_REG_SP);
    uint32_t bottom = sp - 4U * words;
    if ((bottom & 4U) != 0 && (emu->s.nvic.ccr & 1U << 9) != 0) {
        bottom -= 4U;
        frame[7] |= XPSR_ALIGNED;
    }
    *stored = stack_write(emu, bottom, frame, words);
    put(emu, UC_ARM_REG_SP, bottom);
    return extended ? 0xFFFFFFE1U : 0xFFFFFFF1U;
}

static bool unsupported(emu_t *emu)
{
    if ((get(emu, UC_ARM_REG_CONTROL) & SPSEL) != 0) {
        emu_fail(emu, "the process stack is in use: not modelled");
        return true;
    }
    if ((get(emu, UC_ARM_REG_CONTROL) & FPCA) != 0 && (emu->s.nvic.cpacr & 0xF00000U) != 0xF00000U) {
        emu_fail(emu, "a floating-point instruction ran although CPACR does not allow it");
        return true;
    }
    return false;
}

/* Adds the instructions since the last call to the innermost handler, which returns or is interrupted now. */
static void account(emu_t *emu)
{
    nvic_t *n = &emu->s.nvic;
    if (n->nest > 0) {
        n->spent[n->nest - 1] += emu->s.instructions - n->resumed;
    }
    n->resumed = emu->s.instructions;
}

static void count_run(emu_t *emu, int vector, uint64_t spent)
{
    emu_counts_t *c = &emu->counts[vector];
    c->least = c->runs == 0 || spent < c->least ? (uint32_t)spent : c->least;
    c->most = spent > c->most ? (uint32_t)spent : c->most;
    c->sum += spent;
    c->runs++;
}

static void enter(emu_t *emu, int vector)
{
    nvic_t *n = &emu->s.nvic;
    uint32_t handler = 0;
    if (unsupported(emu)) {
        return;
    }
    if (n->nest >= NEST_MAX) {
        emu_fail(emu, "more than %d exceptions are active", NEST_MAX);
        return;
    }
    bool stored;
    const uint32_t code = push_frame(emu, &stored);
    if (!stored && vector != NMI && vector != HARD_FAULT) { /* the exception stays pending */
        vector = HARD_FAULT;
        n->hfsr |= FORCED;
    }
    put(emu, UC_ARM_REG_LR, n->nest == 0 ? code | 8U : code);
    put(emu, UC_ARM_REG_CONTROL, 0);
    bit_set(n->pending, vector, false);
    account(emu);
    n->spent[n->nest] = 0;
    n->active[n->nest++] = (uint8_t)vector;
    put(emu, UC_ARM_REG_XPSR, 1U << 24 | (uint32_t)vector);
    put(emu, UC_ARM_REG_IPSR, (uint32_t)vector);
    const bool found = uc_mem_read(emu->uc, n->vtor + 4U * (uint32_t)vector, &handler, 4) == UC_ERR_OK;
    if (!found || (handler & 1U) == 0 || handler >= RAM_BASE + RAM_SIZE) {
        emu_fail(emu, "vector %d (IRQ %d) has no handler", vector, vector - 16);
        return;
    }
    emu->s.pc = handler & ~1U;
    emu->s.now += 12ULL * emu->s.core_ticks; /* TRM: twelve cycles, without wait states */
    if (emu->profile != NULL) {
        profile_enter(emu, vector, get(emu, UC_ARM_REG_SP), words_of(code));
    }
    if (emu->on_exception != NULL) {
        emu->on_exception(emu->on_exception_user, vector, true);
    }
}

/* At the priority of HardFault or above the core locks up, and the chip resets. */
void nvic_fault(emu_t *emu, int vector)
{
    nvic_t *n = &emu->s.nvic;
    const int current = masked_priority(emu, active_priority(n));
    const bool is_enabled = (n->shcsr >> (16 + vector - MEMORY_FAULT) & 1U) != 0U;
    if (is_enabled && priority_of(n, vector) < current) {
        enter(emu, vector);
        return;
    }
    n->hfsr |= FORCED;
    if (current > -1) {
        enter(emu, HARD_FAULT);
        return;
    }
    emu->s.reset_wanted = true;
    emu->s.reset_cause = LOCK_UP;
    emu->s.stop = true;
}

bool nvic_take(emu_t *emu)
{
    const int vector = nvic_best(emu);
    emu->s.poll_masks = vector < 0 && first_pending(&emu->s.nvic) >= 0 &&
                        priority_of(&emu->s.nvic, first_pending(&emu->s.nvic)) < active_priority(&emu->s.nvic);
    if (vector < 0) {
        return false;
    }
    enter(emu, vector);
    return true;
}

static bool pop_frame(emu_t *emu, bool extended)
{
    uint32_t frame[EXTENDED_WORDS];
    const uint32_t words = extended ? EXTENDED_WORDS : FRAME_WORDS, sp = get(emu, UC_ARM_REG_SP);
    if (uc_mem_read(emu->uc, sp, frame, (size_t)4U * words) != UC_ERR_OK) {
        emu_fail(emu, "the stack is outside the memory: exception frame at 0x%08x", sp);
        return false;
    }
    put(emu, UC_ARM_REG_IPSR, frame[7] & XPSR_VECTOR);
    for (int i = 0; i < 6; i++) {
        put(emu, frame_registers[i], frame[i]);
    }
    put(emu, UC_ARM_REG_CONTROL, extended ? FPCA | SFPA : 0U);
    for (int i = 0; extended && i < 16; i++) {
        put(emu, UC_ARM_REG_S0 + i, frame[FRAME_WORDS + i]);
    }
    if (extended) {
        put(emu, UC_ARM_REG_FPSCR, frame[24]);
    }
    put(emu, UC_ARM_REG_SP, sp + 4U * words + ((frame[7] & XPSR_ALIGNED) != 0 ? 4U : 0U));
    put(emu, UC_ARM_REG_XPSR, (frame[7] & ~(uint32_t)XPSR_ALIGNED) | 1U << 24);
    emu->s.pc = frame[6] & ~1U;
    return true;
}

void nvic_return(emu_t *emu)
{
    nvic_t *n = &emu->s.nvic;
    const uint32_t code = emu->s.exc_return;
    if (n->nest == 0 || (code & 0xFFFFFFE7U) != 0xFFFFFFE1U || ((code & 8U) != 0) != (n->nest == 1)) {
        emu_fail(emu, "0x%08x is no valid exception return with %u exceptions active", code, n->nest);
        return;
    }
    account(emu);
    const int vector = n->active[--n->nest];
    count_run(emu, vector, n->spent[n->nest]);
    if (!pop_frame(emu, (code & STANDARD_FRAME) == 0)) {
        return;
    }
    if (bit(n->line, vector)) {
        bit_set(n->pending, vector, true); /* its cause is still active */
    }
    emu->s.now += 10ULL * emu->s.core_ticks;
    if (emu->profile != NULL) {
        profile_leave(emu, get(emu, UC_ARM_REG_SP), words_of(code));
    }
    n->sleeping = n->nest == 0 && (n->scr & 2U) != 0; /* SLEEPONEXIT */
    if (emu->on_exception != NULL) {
        emu->on_exception(emu->on_exception_user, vector, false);
    }
}
