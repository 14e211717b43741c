/* SPDX-License-Identifier: Apache-2.0 */
#include "hal/s32k144/serial_angle.h"

#include "fx/codegen.h"
#include "hal/s32k144/registers.h"
#include "hal/s32k144/sampling.h"
#include "hal/s32k144/startup.h"

#define FIFO_WORDS 4U
#define WAIT_LOOPS 200U    /* 12 us and more; a frame takes 2 us */
#define PDB0_PULSE 36U
#define PULSE_TICKS 56U    /* 0.5 us: longer than a clock of the LPSPI, shorter than a frame */
#define ONE_RECEIVED LPSPI_FSR_RXCOUNT(1U)
#define ONE_LEFT LPSPI_FSR_TXCOUNT(1U)

void serial_angle_init(const serial_angle_timing_t *timing)
{
    LPSPI0->CR = 0;
    LPSPI0->CFGR0 = 0;
    LPSPI0->CFGR1 = LPSPI_CFGR1_MASTER;
    LPSPI0->CCR = LPSPI_CCR_SCKDIV(timing->bit - 2U) | LPSPI_CCR_DBT(timing->gap - 2U) |
                  LPSPI_CCR_PCSSCK(timing->select - 1U) | LPSPI_CCR_SCKPCS(SERIAL_ANGLE_RELEASE - 1U);
    LPSPI0->CR = LPSPI_CR_MEN | LPSPI_CR_RTF | LPSPI_CR_RRF;
}

uint32_t serial_angle_exchange(uint32_t word_sent)
{
    LPSPI0->TDR = word_sent;
    for (uint32_t k = 0; k < WAIT_LOOPS; k++) {
        if ((LPSPI0->RSR & LPSPI_RSR_RXEMPTY) == 0U) {
            return LPSPI0->RDR;
        }
    }
    return 0;
}

/* The command passes through the transmit FIFO and must have left it before the request holds the FIFO back. */
void serial_angle_start(const serial_angle_t *config)
{
    LPSPI0->TCR = config->command;
    await(&LPSPI0->FSR, LPSPI_FSR_TXCOUNT_MASK, 0);
    LPSPI0->CR = 0;
    LPSPI0->CFGR0 = LPSPI_CFGR0_HREN | LPSPI_CFGR0_HRPOL | LPSPI_CFGR0_HRSEL;
    LPSPI0->CR = LPSPI_CR_MEN | LPSPI_CR_RRF;
    for (uint32_t k = 0; k < FIFO_WORDS; k++) {
        LPSPI0->TDR = config->word;
    }
    TRGMUX->TRGMUX_LPSPI0 = TRGMUX_LPSPI0_SEL0(PDB0_PULSE);
    sampling_pulse(config->start, config->start + PULSE_TICKS);
}

/* Each frame that is taken is replaced by a word to send, so that the FIFO stays full. The usual period has received
 * one frame and has words left: FSR contains nothing but these two counts, so that one comparison finds it. */
uint32_t serial_angle_read(uint32_t word, uint32_t *frame)
{
    const uint32_t state = LPSPI0->FSR;
    if (FX_USUALLY(state - (ONE_RECEIVED | ONE_LEFT) < LPSPI_FSR_TXCOUNT_MASK)) {
        *frame = LPSPI0->RDR;
        LPSPI0->TDR = word;
        return 1U;
    }
    const uint32_t received = state & LPSPI_FSR_RXCOUNT_MASK;
    for (uint32_t left = received; left != 0U; left -= ONE_RECEIVED) {
        *frame = LPSPI0->RDR;
        LPSPI0->TDR = word;
    }
    return (state & LPSPI_FSR_TXCOUNT_MASK) != 0U ? received / ONE_RECEIVED : 0U;
}
