/* SPDX-License-Identifier: Apache-2.0 */
#ifndef HAL_S32K144_AD2S1210_H
#define HAL_S32K144_AD2S1210_H
/** A frame of the AD2S1210 resolver-to-digital converter in normal mode: 16 bits of position or velocity, most
 * significant first, then the 8-bit fault register.
 * Source   Analog Devices AD2S1210 data sheet, serial interface
 * Units    position: fraction of a turn, 2^16 = one turn, whatever the resolution (unused low bits are 0);
 *          velocity: two's complement, full scale = the resolution's largest tracking rate
 * Errors   fault: one bit per cause, 0 = none; a line stuck high reads as all faults, stuck low as position 0
 * Context  values only */
#include <stdint.h>

enum {
    AD2S1210_PARITY = 1 << 0,    /* of the configuration */
    AD2S1210_PHASE = 1 << 1,     /* lock range exceeded */
    AD2S1210_SPEED = 1 << 2,     /* beyond the largest tracking rate */
    AD2S1210_TRACKING = 1 << 3,  /* loss of tracking */
    AD2S1210_MISMATCH = 1 << 4,  /* degradation: sine and cosine differ */
    AD2S1210_OVERRANGE = 1 << 5, /* degradation: too large */
    AD2S1210_SIGNAL_LOSS = 1 << 6,
    AD2S1210_CLIPPED = 1 << 7
};

#define AD2S1210_BITS 24U
#define AD2S1210_FAULTS 0xFFU /* all of them */
#define AD2S1210_REGISTER_BITS 8U /* of an address or a register, in configuration mode */
#define AD2S1210_FAULT_REGISTER 0xFFU

typedef struct {
    uint16_t value;
    uint8_t fault;
} ad2s1210_frame_t;

static inline ad2s1210_frame_t ad2s1210_decode(uint32_t received)
{
    return (ad2s1210_frame_t){(uint16_t)(received >> 8), (uint8_t)received};
}

#endif
