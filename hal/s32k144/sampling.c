/* SPDX-License-Identifier: Apache-2.0 */
#include "hal/s32k144/sampling.h"

#include "hal/adc.h"
#include "hal/s32k144/registers.h"
#include "hal/s32k144/startup.h"

#define FTM0_INIT_TRIGGER 22U
#define BITS_12 1U
#define SAMPLE_CLOCKS 7U /* 8 ADC clocks, 286 ns: the data sheet wants 275 */
#define AVERAGE_32 3U
#define HALF_CLOCK 1U
#define DIE_SENSOR 26U

/* ADC0: PTA0, PTA1, PTA6 (channels 0, 1, 2); ADC1: PTA2, PTA3, PTD2 (channels 0, 1, 2). */
enum { I_A = 0, I_C = 1, WINDING = 2, DIE = 3 };
enum { I_B = 0, V_DC = 1, INVERTER = 2 };

/* From nothing: what an earlier run left in the converter's correction would be carried on. */
static void forget_calibration(adc_t *adc)
{
    adc->CLPS = 0;
    adc->CLP3 = 0;
    adc->CLP2 = 0;
    adc->CLP1 = 0;
    adc->CLP0 = 0;
    adc->CLPX = 0;
    adc->CLP9 = 0;
}

static void calibrate(adc_t *adc)
{
    forget_calibration(adc);
    adc->CFG1 = ADC_CFG1_MODE(BITS_12) | ADC_CFG1_ADIV(HALF_CLOCK);
    adc->SC3 = ADC_SC3_CAL | ADC_SC3_AVGE | ADC_SC3_AVGS(AVERAGE_32);
    await(&adc->SC3, ADC_SC3_CAL, 0);
    adc->SC3 = 0;
    adc->CFG1 = ADC_CFG1_MODE(BITS_12);
    adc->CFG2 = ADC_CFG2_SMPLTS(SAMPLE_CLOCKS);
    adc->SC2 = ADC_SC2_ADTRG;
}

/* The first conversion by the trigger, each further one by the end of the one before it. */
static void chain(pdb_t *pdb, uint32_t conversions)
{
    const uint32_t all = (1U << conversions) - 1U;
    pdb->MOD = 1000; /* counts on a little after the trigger, then waits for the next */
    pdb->CH0DLY0 = 0;
    pdb->CH0C1 = PDB_CH0C1_EN(all) | PDB_CH0C1_TOS(1) | PDB_CH0C1_BB(all & ~1U);
    pdb->SC = PDB_SC_PDBEN;
    pdb->SC = PDB_SC_PDBEN | PDB_SC_LDOK;
}

void sampling_init(void)
{
    calibrate(ADC0);
    calibrate(ADC1);
    ADC0->SC1[I_A] = ADC_SC1_ADCH(0);
    ADC0->SC1[I_C] = ADC_SC1_ADCH(1) | ADC_SC1_AIEN;
    ADC0->SC1[WINDING] = ADC_SC1_ADCH(2);
    ADC0->SC1[DIE] = ADC_SC1_ADCH(DIE_SENSOR);
    ADC1->SC1[I_B] = ADC_SC1_ADCH(0);
    ADC1->SC1[V_DC] = ADC_SC1_ADCH(1);
    ADC1->SC1[INVERTER] = ADC_SC1_ADCH(2);
    TRGMUX->TRGMUX_PDB0 = TRGMUX_PDB0_SEL0(FTM0_INIT_TRIGGER);
    TRGMUX->TRGMUX_PDB1 = TRGMUX_PDB1_SEL0(FTM0_INIT_TRIGGER);
    chain(PDB0, 4);
    chain(PDB1, 3);
}

void hal_adc_read(adc_counts_t *counts)
{
    counts->i_a = ADC0->R[I_A];
    counts->i_b = ADC1->R[I_B];
    counts->i_c = ADC0->R[I_C]; /* ends the interrupt's request */
    counts->v_dc = ADC1->R[V_DC];
}

uint16_t sampling_winding(void)
{
    return (uint16_t)ADC0->R[WINDING];
}

uint16_t sampling_inverter(void)
{
    return (uint16_t)ADC1->R[INVERTER];
}

uint16_t sampling_die(void)
{
    return (uint16_t)ADC0->R[DIE];
}
