/* SPDX-License-Identifier: Apache-2.0 */
#include "hal/s32k144/pins.h"

#include <stddef.h>

#include "hal/s32k144/registers.h"

typedef struct {
    port_t *port;
    uint8_t pin;
    uint8_t function;
    uint8_t pull; /* PORT_PCR_PE and PORT_PCR_PS, or 0 */
} pin_t;

#define GPIO 1U
#define PULL_UP (PORT_PCR_PE | PORT_PCR_PS)
#define PULL_DOWN PORT_PCR_PE
#define OUTPUTS                                                                                              \
    ((1U << PIN_PRECHARGE) | (1U << PIN_MAIN_CONTACTOR) | (1U << PIN_DISCHARGE) | (1U << PIN_GATE_DRIVER) | \
     (1U << PIN_RESOLVER_A0) | (1U << PIN_RESOLVER_A1))

/* The analogue inputs, PTA0 ... PTA3, PTA6 and PTD2, are as reset leaves them. */
static const pin_t pins[] = {
    {PORTD, 15, 2, 0},                /* FTM0_CH0, upper switch of phase a */
    {PORTD, 16, 2, 0},                /* FTM0_CH1, lower switch of phase a */
    {PORTD, 0, 2, 0},                 /* FTM0_CH2 */
    {PORTD, 1, 2, 0},                 /* FTM0_CH3 */
    {PORTB, 4, 2, 0},                 /* FTM0_CH4 */
    {PORTB, 5, 2, 0},                 /* FTM0_CH5 */
    {PORTE, 8, 2, 0},                 /* FTM0_CH6, SAMPLE of the AD2S1210 */
    {PORTA, 14, 2, PULL_UP},          /* FTM0_FLT0, gate driver fault, active low */
    {PORTD, 10, 3, PULL_UP},          /* FTM2_QD_PHB */
    {PORTD, 11, 3, PULL_UP},          /* FTM2_QD_PHA */
    {PORTD, PIN_INDEX, 2, PULL_DOWN}, /* FTM2_CH2, index of the encoder; a broken wire never shows one */
    {PORTB, 0, 3, 0},                 /* LPSPI0_PCS0, WR/FSYNC of the AD2S1210 */
    {PORTB, 1, 3, 0},                 /* LPSPI0_SOUT */
    {PORTB, 2, 3, 0},                 /* LPSPI0_SCK */
    {PORTB, 3, 3, 0},                 /* LPSPI0_SIN */
    {PORTE, 4, 5, PULL_UP},           /* CAN0_RX */
    {PORTE, 5, 5, 0},                 /* CAN0_TX */
    {PORTC, PIN_PRECHARGE, GPIO, 0},
    {PORTC, PIN_MAIN_CONTACTOR, GPIO, 0},
    {PORTC, PIN_DISCHARGE, GPIO, 0},
    {PORTC, PIN_GATE_DRIVER, GPIO, 0},
    {PORTC, PIN_RESOLVER_A0, GPIO, 0},
    {PORTC, PIN_RESOLVER_A1, GPIO, 0},
};

static bool offered; /* the line of the safe state may be driven low */

void pins_init(void)
{
    offered = false;
    PTC->PCOR = OUTPUTS; /* all off before they become outputs */
    PTC->PDDR = OUTPUTS;
    for (size_t k = 0; k < sizeof pins / sizeof pins[0]; k++) {
        pins[k].port->PCR[pins[k].pin] = PORT_PCR_MUX(pins[k].function) | pins[k].pull;
    }
}

void pins_keep_bridge(bool keep)
{
    const uint32_t line = 1U << PIN_SAFE_STATE;
    PTC->PDDR = (keep && offered) ? PTC->PDDR | line : PTC->PDDR & ~line;
}

void pins_offer_bridge(void)
{
    PTC->PCOR = 1U << PIN_SAFE_STATE;
    PORTC->PCR[PIN_SAFE_STATE] = PORT_PCR_MUX(GPIO);
    offered = true;
}
