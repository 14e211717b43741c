/* SPDX-License-Identifier: Apache-2.0 */
#include "hal/angle.h"

#include "fx/codegen.h"
#include "fx/q.h"
#include "hal/s32k144/angle.h"
#include "hal/s32k144/clock.h"
#include "hal/s32k144/core.h"
#include "hal/s32k144/pins.h"
#include "hal/s32k144/registers.h"

#define COUNTS_PER_TURN 16384U /* 4096 lines, four edges each */
#define TURN_SHIFT 18          /* 2^32 / COUNTS_PER_TURN */
#define INPUT_FILTER 0x444U    /* channels 0 to 2: 4 clocks of 4 */
#define SYSTEM_CLOCK 1U
#define FIRST_PER_S 10000U /* length of the first measurement of the speed */

static struct {
    int32_t at_last, at_index; /* reading of the period before; where the counter was when the index rose */
    int32_t q32_per_tick;      /* share of a period, 2^32 = 1 */
    volatile bool absolute;
} encoder;

static void start_decoder(void)
{
    FTM2->MODE = FTM_MODE_FTMEN | FTM_MODE_WPDIS;
    FTM2->CNTIN = 0;
    FTM2->MOD = COUNTS_PER_TURN - 1U;
    FTM2->CNT = 0; /* loads CNTIN */
    FTM2->FILTER = INPUT_FILTER;
    FTM2->QDCTRL = FTM_QDCTRL_QUADEN | FTM_QDCTRL_PHAFLTREN | FTM_QDCTRL_PHBFLTREN;
    FTM2->SC = FTM_SC_CLKS(SYSTEM_CLOCK);
}

/* Channel 2 takes the counter's value when the index rises. A rotor that stands on its index makes no edge: the counter
 * is then right from its start. */
static void find_index(void)
{
    FTM2->C2SC = FTM_C2SC_ELSA;
    encoder.at_index = 0;
    encoder.absolute = (PTD->PDIR & 1U << PIN_INDEX) != 0U;
}

void angle_init(uint32_t period_ticks)
{
    encoder.q32_per_tick = (int32_t)(UINT32_MAX / period_ticks);
    encoder.at_last = 0;
    start_decoder();
    find_index();
}

bool hal_angle_is_absolute(void)
{
    return encoder.absolute;
}

uint32_t angle_follow_index(void)
{
    if (encoder.absolute || (FTM2->C2SC & FTM_C2SC_CHF) == 0U) {
        return 0;
    }
    const uint32_t at_index = FTM2->C2V << TURN_SHIFT;
    encoder.at_index = (int32_t)at_index;
    encoder.at_last = (int32_t)((uint32_t)encoder.at_last - at_index);
    encoder.absolute = true;
    return 0U - at_index;
}

/* The counts of 0.1 ms: one is 37 rpm. */
float angle_first_speed(void)
{
    start_decoder();
    core_pass(CLOCK_FIRST_HZ / FIRST_PER_S);
    const int32_t counts = (int32_t)(FTM2->CNT << TURN_SHIFT) >> TURN_SHIFT;
    return (float)fx_abs_q31(counts) * ((float)FIRST_PER_S / (float)COUNTS_PER_TURN);
}

bool angle_fault(void)
{
    return false;
}

/* Since the currents were sampled at the start of the period the rotor has moved on, by the travel of the last period
 * times the share of this period that has passed (FTM0). The share must stay below one half, or it would be
 * negative. */
uint32_t hal_angle_read(void)
{
    const fx_two_words_t at = FX_LOAD_TWO(&encoder, at_last, at_index);
    const int32_t now = (int32_t)((FTM2->CNT << TURN_SHIFT) - (uint32_t)at.second);
    const int32_t passed = (int32_t)(FTM0->CNT * (uint32_t)encoder.q32_per_tick);
    const int32_t travel = (int32_t)((uint32_t)now - (uint32_t)at.first);
    encoder.at_last = now;
    return (uint32_t)fx_mulhi_sub(now, travel, passed);
}
