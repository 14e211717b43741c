/* SPDX-License-Identifier: Apache-2.0 */
#include "hal/angle.h"

#include "hal/s32k144/ad2s1210.h"
#include "hal/s32k144/angle.h"
#include "hal/s32k144/pins.h"
#include "hal/s32k144/pwm.h"
#include "hal/s32k144/registers.h"
#include "hal/s32k144/resolver.h"

#define CLOCK_DIVIDER 0U   /* 28 MHz / (0 + 2) = 14 MHz */
#define FRAME_GAP 3U       /* of 28 MHz: between frames, and around the chip select */
#define FIFO_WORDS 4U
#define WAIT_LOOPS 200U    /* 12 us and more; a frame takes 2 us */

/* Written and read by the fast ISR alone, but velocity, one aligned half word. */
static ad2s1210_frame_t position;
static volatile int16_t velocity;
static bool missing; /* a frame was not received: the last angle is kept and the fault raised */

/* The converter keeps every fault, including those of its own power-up, until its register has been read in
 * configuration mode between two falling edges of SAMPLE; the second edge comes with the first PWM period. A fault that
 * persists appears in the first frames. */
static void clear_faults(void)
{
    pwm_sample_by_hand();
    PTC->PSOR = (1U << PIN_RESOLVER_A0) | (1U << PIN_RESOLVER_A1);
    LPSPI0->TCR = LPSPI_TCR_FRAMESZ(AD2S1210_REGISTER_BITS - 1U) | LPSPI_TCR_CPHA | LPSPI_TCR_PRESCALE(0);
    LPSPI0->TDR = AD2S1210_FAULT_REGISTER; /* its address, then its content */
    LPSPI0->TDR = AD2S1210_FAULT_REGISTER;
    for (uint32_t k = 0, frames = 0; k < WAIT_LOOPS && frames < 2U; k++) {
        if ((LPSPI0->RSR & LPSPI_RSR_RXEMPTY) == 0U) {
            (void)LPSPI0->RDR;
            frames++;
        }
    }
}

void angle_init(uint32_t period_ticks)
{
    (void)period_ticks;
    LPSPI0->CR = 0;
    LPSPI0->CFGR1 = LPSPI_CFGR1_MASTER;
    LPSPI0->CCR = LPSPI_CCR_SCKDIV(CLOCK_DIVIDER) | LPSPI_CCR_DBT(FRAME_GAP) | LPSPI_CCR_PCSSCK(FRAME_GAP) |
                  LPSPI_CCR_SCKPCS(FRAME_GAP);
    LPSPI0->CR = LPSPI_CR_MEN | LPSPI_CR_RTF | LPSPI_CR_RRF;
    clear_faults();
    PTC->PCOR = (1U << PIN_RESOLVER_A0) | (1U << PIN_RESOLVER_A1); /* normal mode, position */
    LPSPI0->TCR = LPSPI_TCR_FRAMESZ(AD2S1210_BITS - 1U) | LPSPI_TCR_CPHA | LPSPI_TCR_PRESCALE(0);
}

/* The velocity requested a period ago has been received. Starts the transfer of the position that this period's SAMPLE
 * pulse has latched; the receive FIFO must be empty before. */
void angle_begin(void)
{
    for (uint32_t k = 0; k < FIFO_WORDS && (LPSPI0->RSR & LPSPI_RSR_RXEMPTY) == 0U; k++) {
        velocity = (int16_t)ad2s1210_decode(LPSPI0->RDR).value;
    }
    PTC->PCOR = 1U << PIN_RESOLVER_A1;
    LPSPI0->TDR = 0;
}

uint32_t hal_angle_read(void)
{
    for (uint32_t k = 0; k < WAIT_LOOPS; k++) {
        if ((LPSPI0->RSR & LPSPI_RSR_RXEMPTY) == 0U) {
            position = ad2s1210_decode(LPSPI0->RDR);
            missing = false;
            return (uint32_t)position.value << 16;
        }
    }
    missing = true;
    return (uint32_t)position.value << 16;
}

void angle_end(void)
{
    PTC->PSOR = 1U << PIN_RESOLVER_A1;
    LPSPI0->TDR = 0;
}

bool angle_fault(void)
{
    return missing || position.fault != 0U;
}

int16_t resolver_velocity(void)
{
    return velocity;
}
