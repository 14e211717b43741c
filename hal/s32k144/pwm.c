/* SPDX-License-Identifier: Apache-2.0 */
#include "hal/pwm.h"

#include "fx/codegen.h"
#include "hal/s32k144/core.h"
#include "hal/s32k144/pwm.h"
#include "hal/s32k144/registers.h"

#define SYSTEM_CLOCK 1U
#define ALL_CHANNELS_MANUAL 2U
#define SAFE_IN_DEBUG 1U /* a halted core stops the counter and disables the outputs */
#define FAULT_FILTER 4U
#define SIX_OUTPUTS 0x3FU
#define HELD (SIX_OUTPUTS | 0x2A00U) /* SWOCTRL: the lower outputs high, the upper ones low */
#define ONE_OF_EACH_PAIR 0x15U
#define SAMPLE_PULSE_TICKS 112U /* 1 us */
#define SAMPLE_HELD 0x40U   /* SWOCTRL: channel 6 by software, */
#define SAMPLE_HIGH 0x4000U /* at this level */
#define MICROSECOND_LOOPS 112
#define FTM0_INIT_TRIGGER 22U
#define PERIOD_MAX 65532U   /* 16 bits; a multiple of 4, for the tick's timer */
#define DEAD_TIME_MAX 1023U
#define DEAD_TIME_BY_4 2U

#define PAIR(n)                                                                                         \
    (FTM_COMBINE_COMBINE##n | FTM_COMBINE_COMP##n | FTM_COMBINE_DTEN##n | FTM_COMBINE_SYNCEN##n | \
     FTM_COMBINE_FAULTEN##n)
/* Compare values at the next start by SWSYNC, the output mask by TRIG0, which a write without it would disarm. */
#define LOAD (FTM_SYNC_CNTMAX | FTM_SYNC_SYNCHOM | FTM_SYNC_SWSYNC | FTM_SYNC_TRIG0)
#define ENABLED                                                                                                    \
    (FTM_SC_PWMEN0 | FTM_SC_PWMEN1 | FTM_SC_PWMEN2 | FTM_SC_PWMEN3 | FTM_SC_PWMEN4 | FTM_SC_PWMEN5 | FTM_SC_PWMEN6)

static struct {
    uint32_t period;
    bool switching;                   /* as last commanded */
    uint32_t dead_time;               /* ticks */
} bridge;                             /* adjacent: one address serves both in every period */
static volatile bool fault_for_board; /* set by the fault interrupt, taken by its reader */
static volatile bool ended_by_fault;  /* set by the fault interrupt, until switching is enabled again */
static uint32_t held;                 /* calls of hal_pwm_enable() until the timer takes the short circuit over */
static bool pending;                  /* switching was enabled in this period: the outputs follow from the next on */

/* Ten bits; larger values in steps of four, rounded up, so that the dead time is never shorter than requested. */
static uint32_t dead_time(uint32_t ticks)
{
    const bool coarse = ticks > DEAD_TIME_MAX;
    const uint32_t value = coarse ? (ticks + 3U) / 4U : ticks;
    return FTM_DEADTIME_DTVAL(value) | FTM_DEADTIME_DTVALEX(value >> 6) |
           FTM_DEADTIME_DTPS(coarse ? DEAD_TIME_BY_4 : 0U);
}

static void configure_outputs(const pwm_config_t *config)
{
    FTM0->MODE = FTM_MODE_FTMEN | FTM_MODE_WPDIS;
    FTM0->CONF = FTM_CONF_BDMMODE(SAFE_IN_DEBUG);
    FTM0->CNTIN = 0;
    FTM0->MOD = config->period_ticks - 1U;
    FTM0->C0SC = FTM_C0SC_ELSB; /* the lower switch's channel too: without an edge it does not drive its pin */
    FTM0->C1SC = FTM_C0SC_ELSB;
    FTM0->C2SC = FTM_C0SC_ELSB;
    FTM0->C3SC = FTM_C0SC_ELSB;
    FTM0->C4SC = FTM_C0SC_ELSB;
    FTM0->C5SC = FTM_C0SC_ELSB;
    FTM0->C6SC = FTM_C0SC_ELSB;
    FTM0->COMBINE = PAIR(0) | PAIR(1) | PAIR(2) | FTM_COMBINE_COMBINE3;
    FTM0->POL = 0; /* safe: both switches of a pair off */
    FTM0->DEADTIME = dead_time(config->dead_time_ticks);
    FTM0->C6V = SAMPLE_PULSE_TICKS;
    FTM0->C7V = config->period_ticks;
}

/* The input is enabled last: a fault is latched at its edge, and a line that is already active must make an edge while
 * the fault control is on. */
static void configure_faults(void)
{
    FTM0->FLTPOL = FTM_FLTPOL_FLT0POL;
    FTM0->MODE = FTM_MODE_FTMEN | FTM_MODE_WPDIS | FTM_MODE_FAULTM(ALL_CHANNELS_MANUAL) | FTM_MODE_FAULTIE;
    FTM0->FLTCTRL = FTM_FLTCTRL_FAULT0EN | FTM_FLTCTRL_FFLTR0EN | FTM_FLTCTRL_FFVAL(FAULT_FILTER);
}

/* The outputs are forced low at once, and masked from the start of the next period. */
static void disable_switching(void)
{
    FTM0->SWOCTRL = SIX_OUTPUTS;
    FTM0->OUTMASK = SIX_OUTPUTS;
    FTM0->SYNC = LOAD;
    held = 0;
    pending = false;
}

/* The timer holds the outputs off although the line is no longer active. */
static bool is_fault_over(void)
{
    return (FTM0->FMS & (FTM_FMS_FAULTF | FTM_FMS_FAULTIN)) == FTM_FMS_FAULTF;
}

/* The outputs stay masked until the start of the next period, which takes over mask and duties together. */
static void enable_switching(void)
{
    if (is_fault_over()) {
        FTM0->FMS = FTM_FMS_WPEN; /* clears FAULTF: the fault has ended and was reported to the drive */
        ended_by_fault = false;
    }
    core_irq_clear(IRQ_FTM0_FAULT); /* still pending if the line stayed active after its interrupt */
    core_irq_enable(IRQ_FTM0_FAULT);
    FTM0->OUTMASK = 0;
    FTM0->SWOCTRL = 0;
    FTM0->SYNC = LOAD;
    held = 0;
    pending = true;
}

bool pwm_possible(const pwm_config_t *config)
{
    return config->period_ticks <= PERIOD_MAX && config->period_ticks % 4U == 0U && config->dead_time_ticks > 0U &&
           config->dead_time_ticks <= config->period_ticks / 8U && config->dead_time_ticks <= 4U * DEAD_TIME_MAX;
}

void pwm_init(const pwm_config_t *config)
{
    bridge.period = config->period_ticks;
    TRGMUX->TRGMUX_FTM0 = TRGMUX_FTM0_SEL0(FTM0_INIT_TRIGGER);
    configure_outputs(config);
    configure_faults();
    FTM0->OUTMASK = SIX_OUTPUTS; /* at once, as long as SYNCHOM is not set */
    FTM0->SWOCTRL = SIX_OUTPUTS;
    FTM0->SYNCONF = FTM_SYNCONF_SYNCMODE | FTM_SYNCONF_SWWRBUF | FTM_SYNCONF_HWOM;
    FTM0->SYNC = FTM_SYNC_CNTMAX | FTM_SYNC_SYNCHOM;
    FTM0->CNT = 0;
    FTM0->EXTTRIG = FTM_EXTTRIG_INITTRIGEN; /* after CNT, whose write would be a trigger, too */
    FTM0->SC = ENABLED;
    hal_pwm_write((duty_t){16384, 16384, 16384});
    bridge.switching = false;
    bridge.dead_time = config->dead_time_ticks;
    ended_by_fault = false;
    held = 0;
    pending = false;
}

static void pass_a_microsecond(void)
{
    for (int k = 0; k < MICROSECOND_LOOPS; k++) {
        __asm__ volatile("nop");
    }
}

static uint32_t forced_outputs(void)
{
    return (held != 0U) ? HELD : SIX_OUTPUTS;
}

void pwm_hold_pulse(bool high)
{
    FTM0->SWOCTRL = forced_outputs() | SAMPLE_HELD | (high ? SAMPLE_HIGH : 0U);
}

void pwm_sample_by_hand(void)
{
    pwm_hold_pulse(true);
    pass_a_microsecond();
    pwm_hold_pulse(false);
    pass_a_microsecond();
    FTM0->SWOCTRL = forced_outputs();
}

void pwm_pulse(uint32_t from, uint32_t until)
{
    FTM0->C6V = from;
    FTM0->C7V = until;
    FTM0->SWOCTRL = forced_outputs();
}

/* The mask, which would override the level set by software, is written without SYNCHOM and therefore at once. A fault
 * overrides both. */
void pwm_hold_short_circuit(void)
{
    hal_pwm_write((duty_t){0, 0, 0}); /* the duties that act once the counter runs */
    FTM0->SYNC = FTM_SYNC_CNTMAX;
    FTM0->OUTMASK = 0;
    FTM0->SWOCTRL = HELD;
    FTM0->SYNC = LOAD;
    bridge.switching = true;
    held = 2;
}

void pwm_start(void)
{
    FTM0->SC = ENABLED | FTM_SC_CLKS(SYSTEM_CLOCK);
    FTM0->FMS = FTM_FMS_WPEN; /* not before: it protects CLKS, too */
}

uint32_t pwm_elapsed(void)
{
    return FTM0->CNT;
}

/* First and last tick of the upper switch's pulse, in the middle of the period; beyond MOD there is no match. */
static inline void pulse(volatile uint32_t *from, volatile uint32_t *to, uint32_t duty, uint32_t period, uint32_t half)
{
    const uint32_t ticks = (duty * period + half) >> 15;
    uint32_t rise = (period - ticks) >> 1;
    if (ticks == 0U) {
        rise = (uint32_t)fx_in_register((int32_t)period); /* a branch, free in every other period */
    }
    *from = rise;
    *to = rise + ticks;
}

void hal_pwm_write(duty_t duty)
{
    const uint32_t period = bridge.period;
    const uint32_t half = (uint32_t)fx_in_register(16384); /* in a register: part of the multiply-accumulate */
    ftm_t *timer = FTM0;
    FX_ADDRESS_ONCE(timer);
    pulse(&timer->C0V, &timer->C1V, duty.a, period, half);
    pulse(&timer->C2V, &timer->C3V, duty.b, period, half);
    pulse(&timer->C4V, &timer->C5V, duty.c, period, half);
    timer->SYNC = LOAD;
}

void hal_pwm_enable(bool on)
{
    /* The short circuit after a gate-driver fault at speed: switching was enabled, but the timer has ended it. */
    const bool again = on && ended_by_fault && is_fault_over();
    if (on == bridge.switching && !again && held == 0U) {
        pending = false;
        return;
    }
    bridge.switching = on;
    if (!on) {
        disable_switching();
    } else if (held > 1U) {
        held--; /* the duties of this call act from the next period on */
    } else {
        enable_switching();
    }
}

/* The levels of the outputs at their pins, PTD15, 16, 0, 1 and PTB4, 5 (pins.c): even bits are the upper ones. A pin
 * reads its level whatever digital function it has. */
static uint32_t output_levels(void)
{
    const uint32_t ab = PTD->PDIR, c = PTB->PDIR;
    return (ab >> 15 & 3U) | (ab & 3U) << 2 | (c >> 4 & 3U) << 4;
}

static bool is_one_of_each_pair(uint32_t levels)
{
    return ((levels | levels >> 1) & ONE_OF_EACH_PAIR) == ONE_OF_EACH_PAIR;
}

/* What the pins of the outputs show, not what was commanded. In the dead time both outputs of a pair are off, therefore
 * the levels are collected until it has passed; a reading takes 8 ticks or more. Switching that was not commanded is
 * reported by any output that is on. */
bool hal_pwm_gates(void)
{
    uint32_t seen = output_levels();
    if (!bridge.switching) {
        return seen != 0U;
    }
    const bool latched = (FTM0->FMS & FTM_FMS_FAULTF) != 0U;
    if (pending || (latched && seen == 0U)) {
        return !latched;
    }
    for (uint32_t passed = 0; passed <= bridge.dead_time && !is_one_of_each_pair(seen); passed += 8U) {
        seen |= output_levels();
    }
    return is_one_of_each_pair(seen);
}

/* The interrupt request persists until FAULTF is cleared, which happens only when switching is enabled again; therefore
 * the interrupt is masked here. */
void pwm_gate_fault_isr(void)
{
    fault_for_board = true;
    ended_by_fault = true;
    core_irq_disable(IRQ_FTM0_FAULT);
}

/* Cleared only after it was read as set, so that a fault that the interrupt sets in between is not lost. */
bool pwm_fault_reported(void)
{
    if (fault_for_board) {
        fault_for_board = false;
        return true;
    }
    return (FTM0->FMS & FTM_FMS_FAULTIN) != 0U;
}
