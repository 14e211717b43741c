/* SPDX-License-Identifier: Apache-2.0 */
/* The core's own registers: NVIC, SCB, SysTick, cycle counter; LMEM has addresses among them.
 *
 * documented behaviour                       | modelled | test
 * ------------------------------------------ | -------- | --------------------------------------------
 * NVIC: enable, pend, priority, active; STIR | yes      | test_qemu_takes_the_same_exceptions
 * ICSR, AIRCR.PRIGROUP, SHPR                 | yes      | test_qemu_takes_the_same_exceptions
 * SysTick: count flag, reload, interrupt     | yes      | test_qemu_takes_the_same_exceptions
 * AIRCR: reset request with its key          | refused  | test_what_is_not_modelled_is_an_error
 * CFSR, HFSR, BFAR: cleared by ones           | yes      | test_a_core_fault_is_an_exception
 * DWT: cycle counter                         | no       | -
 * MPU, debug, every other register           | refused  | test_what_is_not_modelled_is_an_error
 */
#include "emu_private.h"

enum {
    DWT_CTRL = 0xE0001000 - 0xE0000000,
    DWT_CYCCNT = DWT_CTRL + 4,
    SCS = 0xE000,
    ICTR = SCS + 4,
    ACTLR = SCS + 8,
    SYST_CSR = SCS + 0x10,
    SYST_RVR = SCS + 0x14,
    SYST_CVR = SCS + 0x18,
    ISER = SCS + 0x100,
    ICER = SCS + 0x180,
    ISPR = SCS + 0x200,
    ICPR = SCS + 0x280,
    IABR = SCS + 0x300,
    IPR = SCS + 0x400,
    CPUID = SCS + 0xD00,
    ICSR = SCS + 0xD04,
    VTOR = SCS + 0xD08,
    AIRCR = SCS + 0xD0C,
    SCR = SCS + 0xD10,
    CCR = SCS + 0xD14,
    SHPR = SCS + 0xD18,
    SHCSR = SCS + 0xD24,
    CFSR = SCS + 0xD28,
    HFSR = SCS + 0xD2C,
    BFAR = SCS + 0xD38,
    CPACR = SCS + 0xD88,
    STIR = SCS + 0xF00,
    TRAPS = 1 << 3 | 1 << 4, /* of CCR */
    FPCCR = SCS + 0xF34,
    FPCAR = SCS + 0xF38,
    DEMCR = SCS + 0xDFC,
    INTERRUPTS = VECTORS - 16,
    SET_WORDS = 4,
    PENDSV = 14,
    SYSTICK = 15,
};

static bool within(uint32_t at, uint32_t first, uint32_t words)
{
    return at >= first && at < first + 4U * words;
}

/* Interrupt n is vector n + 16, and the bit sets are indexed by vector. */
static uint32_t by_interrupt(const uint32_t *set, uint32_t word)
{
    const uint32_t low = set[word] >> 16;
    return word + 1U < VECTOR_WORDS ? low | set[word + 1U] << 16 : low;
}

static uint32_t valid_mask(uint32_t word)
{
    const uint32_t left = INTERRUPTS - 32U * word;
    return left >= 32U ? 0xFFFFFFFFU : (1U << left) - 1U;
}

static void change(uint32_t *set, uint32_t word, uint32_t bits, bool on)
{
    for (uint32_t i = 0; i < 32U; i++) {
        const uint32_t vector = 16U + 32U * word + i;
        if ((bits >> i & 1U) != 0) {
            const uint32_t mask = 1U << (vector % 32U);
            set[vector / 32U] = on ? set[vector / 32U] | mask : set[vector / 32U] & ~mask;
        }
    }
}

static uint32_t active_word(const nvic_t *n, uint32_t word)
{
    uint32_t bits = 0;
    for (uint32_t i = 0; i < n->nest; i++) {
        const uint32_t interrupt = n->active[i] - 16U;
        bits |= n->active[i] >= 16U && interrupt / 32U == word ? 1U << (interrupt % 32U) : 0U;
    }
    return bits;
}

static uint32_t icsr(const emu_t *emu)
{
    const uint32_t active = (uint32_t)emu_active_vector(emu);
    const uint32_t pending = emu->s.nvic.pending[0];
    return active | (pending >> PENDSV & 1U) << 28 | (pending >> SYSTICK & 1U) << 26;
}

/* ---- SysTick ---- */

static uint64_t systick_period(const emu_t *emu)
{
    return (uint64_t)(emu->s.nvic.systick_rvr + 1U) * emu->s.core_ticks;
}

void systick_fire(emu_t *emu)
{
    emu->s.nvic.systick_start = emu_instant(emu);
    emu->s.nvic.systick_csr |= 1U << 16;
    emu_timer(emu, TIMER_SYSTICK, emu_instant(emu) + systick_period(emu));
    if ((emu->s.nvic.systick_csr & 2U) != 0) {
        nvic_pend(emu, SYSTICK);
    }
}

static void systick_write(emu_t *emu, uint32_t value)
{
    emu->s.nvic.systick_csr = value & 7U;
    emu->s.nvic.systick_start = emu->s.now;
    emu_timer(emu, TIMER_SYSTICK, (value & 1U) != 0 ? emu->s.now + systick_period(emu) : NEVER);
}

static uint32_t systick_read(emu_t *emu, uint32_t at)
{
    nvic_t *n = &emu->s.nvic;
    if (at == SYST_RVR) {
        return n->systick_rvr;
    }
    if (at == SYST_CVR) {
        return n->systick_rvr - (uint32_t)((emu->s.now - n->systick_start) / emu->s.core_ticks);
    }
    const uint32_t csr = n->systick_csr;
    n->systick_csr &= 7U;
    return csr;
}

/* ---- reading ---- */

static bool nvic_word(const emu_t *emu, uint32_t at, uint32_t *value)
{
    const nvic_t *n = &emu->s.nvic;
    const uint32_t word = (at & 0x7FU) / 4U;
    if (within(at, ISER, SET_WORDS) || within(at, ICER, SET_WORDS)) {
        *value = by_interrupt(n->enabled, word);
    } else if (within(at, ISPR, SET_WORDS) || within(at, ICPR, SET_WORDS)) {
        *value = by_interrupt(n->pending, word);
    } else if (within(at, IABR, SET_WORDS)) {
        *value = active_word(n, word);
    } else {
        return false;
    }
    return true;
}

static bool system_word(emu_t *emu, uint32_t at, uint32_t *value)
{
    const nvic_t *n = &emu->s.nvic;
    switch (at) {
    case ICTR:
        *value = 3;
        break;
    case ACTLR:
        *value = 0;
        break;
    case SYST_CSR:
    case SYST_RVR:
    case SYST_CVR:
        *value = systick_read(emu, at);
        break;
    case CPUID:
        *value = 0x410FC241U;
        break;
    case ICSR:
        *value = icsr(emu);
        break;
    case VTOR:
        *value = n->vtor;
        break;
    case AIRCR:
        *value = n->aircr;
        break;
    case SCR:
        *value = n->scr;
        break;
    case CCR:
        *value = n->ccr;
        break;
    case SHCSR:
        *value = n->shcsr;
        break;
    case CFSR:
        *value = n->cfsr;
        break;
    case HFSR:
        *value = n->hfsr;
        break;
    case BFAR:
        *value = n->bfar;
        break;
    case CPACR:
        *value = n->cpacr;
        break;
    case FPCCR:
        *value = n->fpccr;
        break;
    case FPCAR:
        *value = n->fpcar;
        break;
    case DEMCR:
        *value = n->demcr;
        break;
    case DWT_CTRL:
        *value = n->dwt_ctrl | 4U << 28;
        break;
    case DWT_CYCCNT:
        *value = (uint32_t)(emu->s.now / emu->s.core_ticks) - n->cyccnt_offset;
        break;
    default:
        return false;
    }
    return true;
}

/* Priorities may be read and written by bytes. */
static uint8_t *priorities(emu_t *emu, uint32_t at, uint32_t size)
{
    if (at >= IPR && at + size <= IPR + INTERRUPTS) {
        return &emu->s.nvic.priority[16U + at - IPR];
    }
    if (at >= SHPR && at + size <= SHPR + 12U) {
        return &emu->s.nvic.priority[4U + at - SHPR];
    }
    return NULL;
}

uint64_t scs_read(uc_engine *uc, uint64_t offset, unsigned size, void *user)
{
    (void)uc;
    emu_t *emu = user;
    const uint32_t at = (uint32_t)offset;
    uint32_t value = 0;
    uint64_t outside = 0;
    const uint8_t *priority = priorities(emu, at, size);
    if (priority != NULL) {
        for (unsigned i = 0; i < size; i++) {
            value |= (uint32_t)priority[i] << (8U * i);
        }
        return value;
    }
    if (size == 4U && (nvic_word(emu, at, &value) || system_word(emu, at, &value))) {
        return value;
    }
    if (!bus_private_read(emu, 0xE0000000U + at, size, &outside)) {
        emu_fail(emu, "read of the core's register 0x%08x (%u bytes): not modelled", 0xE0000000U + at, size);
    }
    return outside;
}

/* ---- writing ---- */

static bool nvic_store(emu_t *emu, uint32_t at, uint32_t value)
{
    nvic_t *n = &emu->s.nvic;
    const uint32_t word = (at & 0x7FU) / 4U;
    const bool enable = within(at, ISER, SET_WORDS), pend = within(at, ISPR, SET_WORDS);
    if (!enable && !pend && !within(at, ICER, SET_WORDS) && !within(at, ICPR, SET_WORDS)) {
        return false;
    }
    if ((value & ~valid_mask(word)) != 0) {
        emu_fail(emu, "write of 0x%08x to 0x%08x: interrupts beyond %d", value, 0xE0000000U + at, INTERRUPTS - 1);
        return true;
    }
    const bool of_enabled = enable || within(at, ICER, SET_WORDS);
    change(of_enabled ? n->enabled : n->pending, word, value, enable || pend);
    return true;
}

static void control_store(emu_t *emu, uint32_t value)
{
    if (value >> 16 != 0x05FAU) {
        emu_fail(emu, "write of SCB.AIRCR: 0x%08x does not contain the key 0x05FA", value);
    }
    emu->s.nvic.aircr = 0xFA050000U | (value & 0x700U);
    if ((value & 4U) != 0) { /* SYSRESETREQ */
        emu->s.reset_wanted = true;
        emu->s.reset_cause = 0x400;
        emu->s.stop = true;
    }
}

static void pend_store(emu_t *emu, uint32_t value)
{
    emu->s.nvic.pending[0] |= (value >> 28 & 1U) << PENDSV | (value >> 26 & 1U) << SYSTICK;
    emu->s.nvic.pending[0] &= ~((value >> 27 & 1U) << PENDSV | (value >> 25 & 1U) << SYSTICK);
}

static bool system_store(emu_t *emu, uint32_t at, uint32_t value)
{
    nvic_t *n = &emu->s.nvic;
    switch (at) {
    case SYST_CSR:
        systick_write(emu, value);
        break;
    case SYST_RVR:
        n->systick_rvr = value & 0xFFFFFFU;
        break;
    case SYST_CVR:
        systick_write(emu, n->systick_csr);
        break;
    case ICSR:
        pend_store(emu, value);
        break;
    case VTOR:
        n->vtor = value & 0xFFFFFF80U;
        break;
    case AIRCR:
        control_store(emu, value);
        break;
    case SCR:
        n->scr = value & 0x16U;
        break;
    case CCR:
        if ((value & TRAPS) != 0U) {
            emu_fail(emu, "write of SCB.CCR: traps of divisions by zero and unaligned accesses are not modelled");
        }
        n->ccr = value;
        break;
    case SHCSR:
        n->shcsr = value;
        break;
    case CFSR: /* a one clears the flag */
        n->cfsr &= ~value;
        break;
    case HFSR:
        n->hfsr &= ~value;
        break;
    case CPACR:
        n->cpacr = value;
        break;
    case FPCCR:
        n->fpccr = value;
        break;
    case DEMCR:
        n->demcr = value;
        break;
    case DWT_CTRL:
        n->dwt_ctrl = value & 1U;
        break;
    case DWT_CYCCNT:
        n->cyccnt_offset = (uint32_t)(emu->s.now / emu->s.core_ticks) - value;
        break;
    case STIR:
        if (value >= INTERRUPTS) {
            emu_fail(emu, "write of STIR: %u, interrupts end at %d", value, INTERRUPTS - 1);
            break;
        }
        change(n->pending, value / 32U, 1U << (value % 32U), true);
        break;
    default:
        return false;
    }
    return true;
}

/* Only the upper four bits of each priority are implemented. */
static void priorities_store(uint8_t *priority, unsigned size, uint32_t value)
{
    for (unsigned i = 0; i < size; i++) {
        priority[i] = (uint8_t)(value >> (8U * i) & 0xF0U);
    }
}

void scs_write(uc_engine *uc, uint64_t offset, unsigned size, uint64_t value, void *user)
{
    (void)uc;
    emu_t *emu = user;
    const uint32_t at = (uint32_t)offset;
    uint8_t *priority = priorities(emu, at, size);
    if (priority != NULL) {
        priorities_store(priority, size, (uint32_t)value);
    } else if ((size != 4U || (!nvic_store(emu, at, (uint32_t)value) && !system_store(emu, at, (uint32_t)value))) &&
               !bus_private_write(emu, 0xE0000000U + at, size, (uint32_t)value)) {
        emu_fail(emu, "write of 0x%08x to the core's register 0x%08x (%u bytes): not modelled", (uint32_t)value,
                 0xE0000000U + at, size);
    }
    nvic_reconsider(emu);
}
