/* SPDX-License-Identifier: Apache-2.0 */
#include "hal/s32k144/sampling.h"

#include "fx/codegen.h"
#include "hal/adc.h"
#include "hal/s32k144/reference.h"
#include "hal/s32k144/registers.h"
#include "hal/s32k144/startup.h"

#define FTM0_INIT_TRIGGER 22U
#define BITS_12 1U
#define SAMPLE_CLOCKS 7U /* 8 ADC clocks, 286 ns: the data sheet requires 275 */
#define AVERAGE_32 3U
#define FULL_CLOCK 0U
#define HALF_CLOCK 1U
#define DIE_SENSOR 26U
#define BANDGAP 27U
#define PULSE_OUTPUT_0 1U
#define ERRORS_MAX 5U /* sequence errors in a row that are a fault */
#define APART_STEPS 10U  /* a longer interval between errors restarts the count */

/* ADC0: PTA0, PTA1, PTA6 (channels 0, 1, 2); ADC1: PTA2, PTA3, PTD2 (channels 0, 1, 2). An analogue angle sensor:
 * sine on PTA7 (channel 3 of ADC0), cosine on PTC7 (channel 5 of ADC1). */
enum { SINE_INPUT = 3, COSINE_INPUT = 5 };
enum { I_A = 0, I_C = 1, WINDING = 2 + ANGLE_BY_ADC, DIE, ADC0_CONVERSIONS };
enum { I_B = 0, V_DC = 1, INVERTER = 2 + ANGLE_BY_ADC, KNOWN, ADC1_CONVERSIONS };
enum {
    FIRST = 0,
    SLOW = WINDING
}; /* conversions that are started by a delay; each other one follows the end of the one before */

#if ANGLE_BY_ADC
#define SLOW_DELAY CH0DLY3
_Static_assert(SLOW == 3 && SAMPLING_ANGLE == 2, "sine and cosine lie between the currents and the slow channels");
#else
#define SLOW_DELAY CH0DLY2
_Static_assert(SLOW == 2, "the slow channels follow the currents");
#endif

static struct {
    uint32_t in_a_row;
    uint32_t last;              /* in steps of the 1 kHz task */
} errors;                       /* written by the sequence errors' interrupt */
static volatile uint32_t steps; /* counted by the 1 kHz task */

/* Calibration starts from zero; results of an earlier run would falsify it. */
static void clear_calibration(adc_t *adc)
{
    adc->CLPS = 0;
    adc->CLP3 = 0;
    adc->CLP2 = 0;
    adc->CLP1 = 0;
    adc->CLP0 = 0;
    adc->CLPX = 0;
    adc->CLP9 = 0;
}

static FX_NOT_INLINED FX_COLD void begin_calibration(adc_t *adc, uint32_t divider)
{
    adc->SC2 = 0;
    clear_calibration(adc);
    adc->CFG1 = ADC_CFG1_MODE(BITS_12) | ADC_CFG1_ADIV(divider);
    adc->SC3 = ADC_SC3_CAL | ADC_SC3_AVGE | ADC_SC3_AVGS(AVERAGE_32);
}

static FX_NOT_INLINED FX_COLD void end_calibration(adc_t *adc)
{
    await(&adc->SC3, ADC_SC3_CAL, 0);
    adc->SC3 = 0;
    adc->CFG1 = ADC_CFG1_MODE(BITS_12);
    adc->CFG2 = ADC_CFG2_SMPLTS(SAMPLE_CLOCKS);
    adc->SC2 = ADC_SC2_ADTRG;
}

/* Both at the same time: each converter calibrates itself, and nothing is converted meanwhile. */
static void begin_calibrations(uint32_t divider)
{
    begin_calibration(ADC0, divider);
    begin_calibration(ADC1, divider);
}

/* The values of the delays act from now on. */
static void load(pdb_t *pdb)
{
    pdb->SC = PDB_SC_PDBEN | PDB_SC_PDBEIE;
    pdb->SC = PDB_SC_PDBEN | PDB_SC_PDBEIE | PDB_SC_LDOK;
}

/* The trigger starts the first conversion, the end of each one the next. The slow channels are converted in the
 * middle of the period, after the fast ISR has read all results of the previous one: a result that is still unread when
 * its next conversion ends leaves the pre-trigger locked, and a lock stops the whole sequence. */
static void chain(pdb_t *pdb, uint32_t conversions, uint32_t period_ticks)
{
    const uint32_t all = (1U << conversions) - 1U;
    const uint32_t delayed = 1U << FIRST | 1U << SLOW;
    pdb->MOD = period_ticks / 2U;
    pdb->CH0DLY0 = 0;
    pdb->SLOW_DELAY = period_ticks / 2U;
    pdb->CH0C1 = PDB_CH0C1_EN(all) | PDB_CH0C1_TOS(delayed) | PDB_CH0C1_BB(all & ~delayed);
    load(pdb);
}

/* The end of the last conversion before the slow ones is the fast ISR's request. */
static void choose_inputs(void)
{
    ADC0->SC1[I_A] = ADC_SC1_ADCH(0);
#if ANGLE_BY_ADC
    ADC0->SC1[I_C] = ADC_SC1_ADCH(1);
    ADC0->SC1[SAMPLING_ANGLE] = ADC_SC1_ADCH(SINE_INPUT) | ADC_SC1_AIEN;
    ADC1->SC1[SAMPLING_ANGLE] = ADC_SC1_ADCH(COSINE_INPUT);
#else
    ADC0->SC1[I_C] = ADC_SC1_ADCH(1) | ADC_SC1_AIEN;
#endif
    ADC0->SC1[WINDING] = ADC_SC1_ADCH(2);
    ADC0->SC1[DIE] = ADC_SC1_ADCH(DIE_SENSOR);
    ADC1->SC1[I_B] = ADC_SC1_ADCH(0);
    ADC1->SC1[V_DC] = ADC_SC1_ADCH(1);
    ADC1->SC1[INVERTER] = ADC_SC1_ADCH(2);
    ADC1->SC1[KNOWN] = ADC_SC1_ADCH(BANDGAP);
}

void sampling_init(uint32_t period_ticks)
{
    begin_calibrations(HALF_CLOCK);
    sampling_first_end();
    choose_inputs();
    TRGMUX->TRGMUX_PDB0 = TRGMUX_PDB0_SEL0(FTM0_INIT_TRIGGER);
    TRGMUX->TRGMUX_PDB1 = TRGMUX_PDB1_SEL0(FTM0_INIT_TRIGGER);
    chain(PDB0, ADC0_CONVERSIONS, period_ticks);
    chain(PDB1, ADC1_CONVERSIONS, period_ticks);
}

void sampling_pulse(uint32_t from, uint32_t until)
{
    PDB0->PODLY = PDB_PODLY_DLY1(from) | PDB_PODLY_DLY2(until);
    PDB0->POEN = PULSE_OUTPUT_0;
    load(PDB0);
}

/* A conversion that is started by the write of SC1. */
static void start_at_once(adc_t *adc, uint32_t input)
{
    adc->SC2 = 0;
    adc->SC1[0] = ADC_SC1_ADCH(input);
}

static uint16_t converted(const adc_t *adc)
{
    await(&adc->SC1[0], ADC_SC1_COCO, ADC_SC1_COCO);
    return (uint16_t)adc->R[0];
}

/* 24 MHz: at most half of the fastest clock, 25 MHz. */
void sampling_first_begin(void)
{
    begin_calibrations(FULL_CLOCK);
}

bool sampling_first_calibrates(void)
{
    return ((ADC0->SC3 | ADC1->SC3) & ADC_SC3_CAL) != 0U;
}

void sampling_first_end(void)
{
    end_calibration(ADC0);
    end_calibration(ADC1);
}

uint16_t sampling_first_v_dc(void)
{
    start_at_once(ADC1, V_DC);
    return converted(ADC1);
}

angle_counts_t sampling_first_angle(void)
{
    start_at_once(ADC0, SINE_INPUT);
    start_at_once(ADC1, COSINE_INPUT);
    const uint32_t sine = converted(ADC0);
    return (angle_counts_t){sine, converted(ADC1)};
}

/* Reads all results of the sequence, also those of the slow channels, so that no pre-trigger stays locked. The slow
 * results stay in their registers for the 1 kHz task. Sine and cosine are read by sampling_angle(). */
void hal_adc_read(adc_counts_t *counts)
{
    const fx_two_words_t from_adc0 = fx_read_two(&ADC0->R[I_A]); /* the second ends the interrupt's request */
    const fx_two_words_t from_adc1 = fx_read_two(&ADC1->R[I_B]);
    (void)fx_read_two(&ADC0->R[WINDING]);
    (void)fx_read_two(&ADC1->R[INVERTER]);
    counts->i_a = (uint32_t)from_adc0.first;
    counts->i_c = (uint32_t)from_adc0.second;
    counts->i_b = (uint32_t)from_adc1.first;
    counts->v_dc = (uint32_t)from_adc1.second;
}

/* The task begins 25 us after the start of a period: its conversions have ended, and the next are 75 us away. A task
 * that begins late may read i_a and i_b of the next period with i_c of this one, because the fast ISR, after which the
 * reading is repeated (ecu.c), follows the second conversion or the third. Such a sample is one of four in the mean
 * (SL-5). */
void hal_adc_latest(current_counts_t *counts)
{
    counts->i_a = ADC0->R[I_A];
    counts->i_c = ADC0->R[I_C];
    counts->i_b = ADC1->R[I_B];
}

/* Disabling the block releases its locks; reading the results lets every conversion complete again. The block then
 * waits for the next period. */
static void restart(pdb_t *pdb, const adc_t *adc, uint32_t conversions)
{
    pdb->SC = 0;
    pdb->CH0S = 0;
    for (uint32_t k = 0; k < conversions; k++) {
        (void)adc->R[k];
    }
    load(pdb);
}

bool sampling_error_isr(void)
{
    if ((PDB0->CH0S & PDB_CH0S_ERR_MASK) != 0U) {
        restart(PDB0, ADC0, ADC0_CONVERSIONS);
    }
    if ((PDB1->CH0S & PDB_CH0S_ERR_MASK) != 0U) {
        restart(PDB1, ADC1, ADC1_CONVERSIONS);
    }
    const uint32_t now = steps;
    errors.in_a_row = now - errors.last <= APART_STEPS ? errors.in_a_row + 1U : 1U;
    errors.last = now;
    return errors.in_a_row >= ERRORS_MAX;
}

void sampling_tick(void)
{
    steps = steps + 1U;
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

int16_t hal_adc_known_permille(void)
{
    return reference_permille((uint16_t)ADC1->R[KNOWN]);
}
