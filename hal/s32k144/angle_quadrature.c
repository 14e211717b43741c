/* SPDX-License-Identifier: Apache-2.0 */
#include "hal/angle.h"

#include "hal/s32k144/angle.h"
#include "hal/s32k144/registers.h"

#define COUNTS_PER_TURN 16384U /* 4096 lines, four edges each */
#define TURN_SHIFT 18          /* 2^32 / COUNTS_PER_TURN */
#define INPUT_FILTER 0x44U     /* channels 0 and 1: 4 clocks of 4 */
#define SYSTEM_CLOCK 1U

void angle_init(void)
{
    FTM2->MODE = FTM_MODE_FTMEN | FTM_MODE_WPDIS;
    FTM2->CNTIN = 0;
    FTM2->MOD = COUNTS_PER_TURN - 1U;
    FTM2->CNT = 0; /* loads CNTIN */
    FTM2->FILTER = INPUT_FILTER;
    FTM2->QDCTRL = FTM_QDCTRL_QUADEN | FTM_QDCTRL_PHAFLTREN | FTM_QDCTRL_PHBFLTREN;
    FTM2->SC = FTM_SC_CLKS(SYSTEM_CLOCK);
}

void angle_begin(void) {}

void angle_end(void) {}

bool angle_fault(void)
{
    return false;
}

uint32_t hal_angle_read(void)
{
    return FTM2->CNT << TURN_SHIFT;
}
