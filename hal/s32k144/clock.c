/* SPDX-License-Identifier: Apache-2.0 */
#include "hal/s32k144/clock.h"

#include "hal/s32k144/registers.h"
#include "hal/s32k144/startup.h"

#define DIVIDE_BY_1 1U /* of the SOSCDIV and SPLLDIV fields */
#define DIVIDE_BY_2 2U
#define DIVIDE_BY_4 3U
#define SOURCE_SPLL 6U
#define HSRUN 3U
#define STATUS_HSRUN 0x80U
#define RUN 0U
#define STATUS_RUN 0x01U
#define PCS_SPLLDIV2 6U
#define PCS_FIRCDIV2 3U

void clock_fast(void)
{
    SMC->PMCTRL = SMC_PMCTRL_RUNM(HSRUN);
    await(&SMC->PMSTAT, SMC_PMSTAT_PMSTAT_MASK, STATUS_HSRUN);
}

void clock_slow(void)
{
    SMC->PMCTRL = SMC_PMCTRL_RUNM(RUN);
    await(&SMC->PMSTAT, SMC_PMSTAT_PMSTAT_MASK, STATUS_RUN);
}

static void start_oscillator(void)
{
    SCG->SOSCDIV = SCG_SOSCDIV_SOSCDIV1(DIVIDE_BY_1) | SCG_SOSCDIV_SOSCDIV2(DIVIDE_BY_1);
    SCG->SOSCCFG = SCG_SOSCCFG_EREFS | SCG_SOSCCFG_RANGE(2); /* crystal, 4 ... 8 MHz */
    SCG->SOSCCSR = SCG_SOSCCSR_SOSCEN;
    await(&SCG->SOSCCSR, SCG_SOSCCSR_SOSCVLD, SCG_SOSCCSR_SOSCVLD);
}

/* 8 MHz / 1 * (12 + 16) / 2 = 112 MHz. */
static void start_pll(void)
{
    SCG->SPLLDIV = SCG_SPLLDIV_SPLLDIV1(DIVIDE_BY_2) | SCG_SPLLDIV_SPLLDIV2(DIVIDE_BY_4);
    SCG->SPLLCFG = SCG_SPLLCFG_PREDIV(0) | SCG_SPLLCFG_MULT(12);
    SCG->SPLLCSR = SCG_SPLLCSR_SPLLEN;
    await(&SCG->SPLLCSR, SCG_SPLLCSR_SPLLVLD, SCG_SPLLCSR_SPLLVLD);
}

/* In high-speed run no clock may change by more than a factor of two, and before it the limit is 80 MHz. Therefore half
 * of the final frequency is selected first. */
static void select_pll(void)
{
    SCG->RCCR = SCG_RCCR_SCS(SOURCE_SPLL) | SCG_RCCR_DIVCORE(1) | SCG_RCCR_DIVBUS(1) | SCG_RCCR_DIVSLOW(3);
    await(&SCG->CSR, SCG_CSR_SCS_MASK, SCG_CSR_SCS(SOURCE_SPLL));
}

static void enter_high_speed(void)
{
    SCG->HCCR = SCG_HCCR_SCS(SOURCE_SPLL) | SCG_HCCR_DIVCORE(0) | SCG_HCCR_DIVBUS(1) | SCG_HCCR_DIVSLOW(3);
    SMC->PMPROT = SMC_PMPROT_AHSRUN;
    clock_fast();
}

/* The loss of a clock resets the processor: the outputs become inputs, and pull-downs at the gate drivers keep the
 * bridge off. */
static void guard_clocks(void)
{
    SCG->SOSCCSR = SCG_SOSCCSR_SOSCEN | SCG_SOSCCSR_SOSCCM | SCG_SOSCCSR_SOSCCMRE;
    SCG->SPLLCSR = SCG_SPLLCSR_SPLLEN | SCG_SPLLCSR_SPLLCM | SCG_SPLLCSR_SPLLCMRE;
}

static void start_cache(void)
{
    LMEM->LMEM_PCCCR = LMEM_PCCCR_INVW0 | LMEM_PCCCR_INVW1 | LMEM_PCCCR_GO;
    await(&LMEM->LMEM_PCCCR, LMEM_PCCCR_GO, 0);
    LMEM->LMEM_PCCCR = LMEM_PCCCR_ENCACHE;
}

#define GATE PCC_FLEXCAN0_CGC

/* The clock source may only be changed while the clock gate is disabled. */
static void enable_clock_gate(volatile uint32_t *gate, uint32_t source)
{
    *gate = 0;
    *gate = PCC_FTM0_PCS(source);
    *gate = PCC_FTM0_PCS(source) | GATE;
}

static void enable_clock_gates(uint32_t source)
{
    enable_clock_gate(&PCC->PCC_ADC0, source);
    enable_clock_gate(&PCC->PCC_ADC1, source);
    enable_clock_gate(&PCC->PCC_LPIT, source);
    enable_clock_gate(&PCC->PCC_LPSPI0, source);
    /* These run on the system clock, or choose their own. */
    PCC->PCC_FTM0 = GATE;
    PCC->PCC_FTM2 = GATE;
    PCC->PCC_PDB0 = GATE;
    PCC->PCC_PDB1 = GATE;
    PCC->PCC_FlexCAN0 = GATE;
    PCC->PCC_PORTA = GATE;
    PCC->PCC_PORTB = GATE;
    PCC->PCC_PORTC = GATE;
    PCC->PCC_PORTD = GATE;
    PCC->PCC_PORTE = GATE;
}

/* The internal oscillator runs from reset; the crystal would need 1.5 ms. */
void clock_first(void)
{
    SCG->FIRCDIV = SCG_FIRCDIV_FIRCDIV2(DIVIDE_BY_2);
    enable_clock_gates(PCS_FIRCDIV2);
}

void clock_init(void)
{
    start_oscillator();
    start_pll();
    select_pll();
    enable_clock_gates(PCS_SPLLDIV2); /* in high-speed run they must not be changed */
    enter_high_speed();
    guard_clocks();
    start_cache();
}
