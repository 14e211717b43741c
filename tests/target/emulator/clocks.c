/* SPDX-License-Identifier: Apache-2.0 */
/* SCG, PCC, SMC, PMC, RCM, SIM, LMEM: clock sources, dividers, run modes, clock gates.
 *
 * documented behaviour                           | modelled | test
 * ---------------------------------------------- | -------- | --------------------------------------------
 * sources, dividers, PLL multiplication          | yes      | test_the_processor_runs_at_112_mhz_with_clock_monitors
 * highest frequencies of RUN and HSRUN           | refused  | test_clocks_beyond_the_data_sheet_are_refused
 * factor of two at most in HSRUN, PMPROT once    | refused  | test_what_is_not_modelled_is_an_error
 * settings of a running oscillator or PLL        | refused  | test_a_running_source_keeps_its_settings
 * PCC: clock gates must not change in HSRUN      | refused  | test_what_is_not_modelled_is_an_error
 * RCM: cause of the last reset                   | yes      | test_an_unserviced_watchdog_resets_and_reports_why
 * start-up of the oscillator, lock of the PLL    | yes      | test_a_source_is_valid_after_its_start_up_time
 * SIM_CHIPCTL: retention of SRAM_U over a reset  | yes      | test_ram_is_kept_over_a_reset_only_where_it_is_retained
 * SIM_CHIPCTL: no access to retained RAM         | refused  | test_what_is_not_modelled_is_an_error
 * LMEM: cache commands are done at once          | yes      | test_a_cache_command_is_done_at_once
 * SIM: converter triggers other than the PDB     | refused  | test_other_trigger_sources_are_refused
 * VLPR, STOP                                     | refused  | test_other_run_modes_are_refused
 * monitors, jitter, cache hits                   | no       | -
 */
#include "emu_private.h"

enum {
    CSR = 0x10,
    RCCR = 0x14,
    VCCR = 0x18,
    HCCR = 0x1C,
    SOSCCSR = 0x100,
    SOSCDIV = 0x104,
    SOSCCFG = 0x108,
    SIRCCSR = 0x200,
    SIRCDIV = 0x204,
    SIRCCFG = 0x208,
    FIRCCSR = 0x300,
    FIRCDIV = 0x304,
    FIRCCFG = 0x308,
    SPLLCSR = 0x600,
    SPLLDIV = 0x604,
    SPLLCFG = 0x608,
    PMPROT = 0x08,
    PMCTRL = 0x0C,
    PMSTAT = 0x14,
    SOSC = 1,
    SIRC = 2,
    FIRC = 3,
    SPLL = 6,
    CRYSTAL_TICKS = 420,
    SIRC_TICKS = 420,
    FIRC_TICKS = 70, /* 8, 8, 48 MHz */
    RUN = 1,
    HSRUN = 0x80,
};
/* Data sheet: 1.5 ms, typical, for a crystal of 8 MHz and low gain; 150 us + 1075 periods of 8 MHz. */
#define OSCILLATOR_START (EMU_TICKS_PER_S / 2000U * 3U)
#define PLL_LOCK (EMU_TICKS_PER_S / 20000U * 3U + 1075ULL * 420U)
#define ENABLED 1U
#define VALID (1U << 24)
#define CGC (1U << 30)
#define INVALIDATE_ALL 0x85000000U /* GO, INVW0, INVW1 */

static uint32_t control_of(int source)
{
    return source == SOSC ? SOSCCSR : source == SIRC ? SIRCCSR : source == FIRC ? FIRCCSR : SPLLCSR;
}

static bool enabled(const emu_t *emu, int source)
{
    return (bus_get(emu, PERIPHERAL(SCG), control_of(source)) & ENABLED) != 0;
}

static bool source_on(const emu_t *emu, int source)
{
    if (source != SOSC && source != SIRC && source != FIRC && source != SPLL) {
        return false;
    }
    return enabled(emu, source) && (source != SPLL || enabled(emu, SOSC));
}

static bool source_valid(const emu_t *emu, int source)
{
    const uint64_t ready = source == SOSC ? emu->s.oscillator_ready : source == SPLL ? emu->s.pll_ready : 0U;
    return source_on(emu, source) && emu->s.now >= ready;
}

static void source_started(emu_t *emu, uint32_t offset, bool was_on)
{
    if (was_on) {
        return;
    }
    if (offset == SOSCCSR) {
        emu->s.oscillator_ready = emu->s.now + OSCILLATOR_START;
    } else if (offset == SPLLCSR) {
        emu->s.pll_ready = emu->s.now + PLL_LOCK;
    }
}

/* (PREDIV, MULT) of 8 MHz: f = 8 MHz (MULT + 16) / (PREDIV + 1) / 2; 0: no whole number of ticks. */
static uint32_t spll_ticks(const emu_t *emu)
{
    const uint32_t cfg = bus_get(emu, PERIPHERAL(SCG), SPLLCFG);
    const uint32_t numerator = CRYSTAL_TICKS * 2U * ((cfg >> 8 & 7U) + 1U), divisor = (cfg >> 16 & 31U) + 16U;
    return numerator % divisor == 0U ? numerator / divisor : 0U;
}

static uint32_t source_ticks(const emu_t *emu, int source)
{
    if (!source_on(emu, source)) {
        return 0;
    }
    return source == SPLL ? spll_ticks(emu) : source == FIRC ? FIRC_TICKS : source == SOSC ? CRYSTAL_TICKS : SIRC_TICKS;
}

/* Period of a clock of the peripherals: a source after its divider 1 or 2; 0: there is no clock. */
uint32_t clocks_async_ticks(const emu_t *emu, int source, int divider)
{
    const uint32_t ticks = source_ticks(emu, source);
    if (ticks == 0) {
        return 0;
    }
    const uint32_t code = bus_get(emu, PERIPHERAL(SCG), control_of(source) + 4U) >> (divider == 2 ? 8 : 0) & 7U;
    return code == 0 ? 0U : ticks << (code - 1U);
}

uint32_t clocks_peripheral_ticks(const emu_t *emu, uint32_t pcc_offset)
{
    return clocks_async_ticks(emu, (int)(bus_get(emu, PERIPHERAL(PCC), pcc_offset) >> 24 & 7U), 2);
}

/* ---- the core's clock ---- */

static bool high_speed(const emu_t *emu)
{
    return (bus_get(emu, PERIPHERAL(SMC), PMCTRL) >> 5 & 3U) == 3U;
}

bool clocks_high_speed(const emu_t *emu)
{
    return high_speed(emu);
}

static uint32_t selected(const emu_t *emu)
{
    return bus_get(emu, PERIPHERAL(SCG), high_speed(emu) ? HCCR : RCCR);
}

/* In high-speed run no clock may change by more than a factor of two at once. */
static bool changes_too_much(uint32_t before, uint32_t after)
{
    return after > 2U * before || before > 2U * after;
}

/* Data sheet: core, bus, flash at most 112/56/28 MHz in HSRUN, 80/48/26.67 MHz in RUN. */
static void core_update(emu_t *emu)
{
    const uint32_t ccr = selected(emu), source = source_ticks(emu, (int)(ccr >> 24 & 15U));
    const uint32_t core = source * ((ccr >> 16 & 15U) + 1U);
    const uint32_t bus = core * ((ccr >> 4 & 15U) + 1U), flash = core * ((ccr & 15U) + 1U);
    const bool high = high_speed(emu);
    if (source == 0 || !source_valid(emu, (int)(ccr >> 24 & 15U))) {
        emu_fail(emu, "SCG selects clock source %u, which is off, not valid yet or no whole number of ticks",
                 ccr >> 24 & 15U);
    } else if (core < (high ? 30U : 42U) || bus < (high ? 60U : 70U) || flash < (high ? 120U : 126U)) {
        const uint32_t ticks_per_ms = EMU_TICKS_PER_S / 1000U;
        emu_fail(emu, "SCG: core %u, bus %u, flash %u kHz are too fast for %s", ticks_per_ms / core, ticks_per_ms / bus,
                 ticks_per_ms / flash, high ? "HSRUN" : "RUN");
    } else if (high && changes_too_much(emu->s.core_ticks, core)) {
        emu_fail(emu, "SCG: in HSRUN the core's clock changes by more than a factor of two");
    } else {
        emu_core_clock(emu, core);
    }
}

bool scg_models(uint32_t offset)
{
    return offset != VCCR && offset != 0x20;
}

uint32_t scg_read(emu_t *emu, const peripheral_t *self, uint32_t offset, uint32_t stored)
{
    (void)self;
    const int source = offset == SOSCCSR ? SOSC : offset == SIRCCSR ? SIRC : offset == FIRCCSR ? FIRC : SPLL;
    switch (offset) {
    case CSR:
        return selected(emu);
    case SOSCCSR:
    case SIRCCSR:
    case FIRCCSR:
    case SPLLCSR:
        return (stored & 0x00FFFFFFU) | (source_valid(emu, source) ? VALID : 0U) |
               ((selected(emu) >> 24 & 15U) == (uint32_t)source ? 1U << 25 : 0U);
    default:
        return stored;
    }
}

void scg_written(emu_t *emu, const peripheral_t *self, uint32_t offset, uint32_t old, uint32_t value)
{
    (void)self;
    source_started(emu, offset, (old & ENABLED) != 0);
    if (offset == SPLLCFG && source_on(emu, SPLL)) {
        emu_fail(emu, "write of SCG.SPLLCFG while the PLL runs: it has no effect");
    } else if (offset == SPLLCSR && (value & ENABLED) != 0 && spll_ticks(emu) == 0) {
        emu_fail(emu, "SCG: the PLL's frequency is no whole number of ticks");
    } else if (offset == SOSCCFG && (bus_get(emu, PERIPHERAL(SCG), SOSCCSR) & ENABLED) != 0 && old != value) {
        emu_fail(emu, "write of SCG.SOSCCFG while the oscillator runs: it has no effect");
    } else if (offset == RCCR || offset == HCCR) {
        core_update(emu);
    }
}

/* ---- SMC ---- */

bool smc_models(uint32_t offset)
{
    return offset != 0x10;
}

uint32_t smc_read(emu_t *emu, const peripheral_t *self, uint32_t offset, uint32_t stored)
{
    (void)self;
    return offset == PMSTAT ? (high_speed(emu) ? HSRUN : RUN) : stored;
}

void smc_written(emu_t *emu, const peripheral_t *self, uint32_t offset, uint32_t old, uint32_t value)
{
    if (offset == PMPROT) {
        if (old != 0U && old != value) {
            emu_fail(emu, "write of SMC.PMPROT: it can be written once after a reset");
        }
        return;
    }
    if (offset != PMCTRL) {
        return;
    }
    const uint32_t mode = value >> 5 & 3U;
    if (mode == 3U && (bus_get(emu, self, PMPROT) & 0x80U) == 0) {
        emu_fail(emu, "write of SMC.PMCTRL: HSRUN is not allowed by PMPROT.AHSRUN");
    } else if (mode == 1U || mode == 2U) {
        emu_fail(emu, "write of SMC.PMCTRL: run mode %u is not modelled", mode);
    } else {
        core_update(emu);
    }
}

/* ---- PCC ---- */

bool pcc_models(uint32_t offset)
{
    (void)offset;
    return true;
}

uint32_t pcc_read(emu_t *emu, const peripheral_t *self, uint32_t offset, uint32_t stored)
{
    (void)emu, (void)self, (void)offset;
    return stored;
}

void pcc_written(emu_t *emu, const peripheral_t *self, uint32_t offset, uint32_t old, uint32_t value)
{
    (void)self;
    if (high_speed(emu) && ((old ^ value) & CGC) != 0) {
        emu_fail(emu, "write of PCC offset 0x%x: clock gates must not be changed in HSRUN", offset);
    }
    if ((old & value & CGC) != 0 && ((old ^ value) & 0x07000000U) != 0) {
        emu_fail(emu, "write of PCC offset 0x%x: the clock source changes while the clock gate is enabled", offset);
    }
}

/* ---- modules of which only some registers are modelled, most without an effect ---- */

bool pmc_models(uint32_t offset)
{
    return offset < 3U;
}

uint32_t pmc_read(emu_t *emu, const peripheral_t *self, uint32_t offset, uint32_t stored)
{
    (void)emu, (void)self, (void)offset;
    return stored;
}

void pmc_written(emu_t *emu, const peripheral_t *self, uint32_t offset, uint32_t old, uint32_t value)
{
    (void)emu, (void)self, (void)offset, (void)old, (void)value;
}

bool rcm_models(uint32_t offset)
{
    return offset == 0U || offset == 4U || offset == 8U;
}

uint32_t rcm_read(emu_t *emu, const peripheral_t *self, uint32_t offset, uint32_t stored)
{
    (void)emu, (void)self, (void)offset;
    return stored;
}

void rcm_written(emu_t *emu, const peripheral_t *self, uint32_t offset, uint32_t old, uint32_t value)
{
    (void)emu, (void)self, (void)offset, (void)old, (void)value;
}

/* CHIPCTL, FTMOPT0, ADCOPT, FTMOPT1, MISCTRL0, SDID and the unique number. */
bool sim_models(uint32_t offset)
{
    return offset == 0x04U || offset == 0x0CU || offset == 0x18U || offset == 0x1CU || offset == 0x20U ||
           offset == 0x24U || (offset >= 0x54U && offset <= 0x60U);
}

uint32_t sim_read(emu_t *emu, const peripheral_t *self, uint32_t offset, uint32_t stored)
{
    (void)emu, (void)self, (void)offset;
    return stored;
}

void sim_written(emu_t *emu, const peripheral_t *self, uint32_t offset, uint32_t old, uint32_t value)
{
    (void)self, (void)old;
    enum { CHIPCTL = 0x04 };
    if (offset == CHIPCTL) {
        emu->s.upper_retained = (value & 1U << 20) == 0U;
        emu_upper_ram_update(emu);
        if ((value & 1U << 21) == 0U) {
            emu_fail(emu, "write of SIM.CHIPCTL: retention of SRAM_L, in which the stack lies, is not modelled");
        }
    }
    if (offset == 0x18U && value != 0U) {
        emu_fail(emu, "write of SIM.ADCOPT: only the PDB triggers the converters in this model");
    }
}

/* The cache: a command completes at once; hits and misses are not modelled. */
bool lmem_models(uint32_t offset)
{
    return offset == 0U || offset == DATA_FLASH_PCCRMR;
}

uint32_t lmem_read(emu_t *emu, const peripheral_t *self, uint32_t offset, uint32_t stored)
{
    (void)emu, (void)self, (void)offset;
    return stored;
}

void lmem_written(emu_t *emu, const peripheral_t *self, uint32_t offset, uint32_t old, uint32_t value)
{
    (void)old;
    if (offset == 0U) {
        bus_put(emu, self, offset, value & 0x7FFFFFFFU);
    }
    if (offset == 0U && (value & INVALIDATE_ALL) == INVALIDATE_ALL) {
        data_flash_uncached(emu);
    }
}

/* Control of the memories: only the speculation of the data flash. */
bool mscm_models(uint32_t offset)
{
    return offset == 0x404U;
}

uint32_t mscm_read(emu_t *emu, const peripheral_t *self, uint32_t offset, uint32_t stored)
{
    (void)emu, (void)self, (void)offset;
    return stored;
}

void mscm_written(emu_t *emu, const peripheral_t *self, uint32_t offset, uint32_t old, uint32_t value)
{
    (void)emu, (void)self, (void)offset, (void)old, (void)value;
}
