/* SPDX-License-Identifier: Apache-2.0 */
#ifndef EMULATOR_FTM_PRIVATE_H
#define EMULATOR_FTM_PRIVATE_H
/** Definitions that the files of the FlexTimer's model share: registers, FTM0's fault control and outputs.
 * Context  emulator only */
#include "emu_private.h"

enum {
    SC = 0x00,
    CNT = 0x04,
    MOD = 0x08,
    C0SC = 0x0C,
    C0V = 0x10,
    C7V = 0x48,
    CNTIN = 0x4C,
    STATUS = 0x50,
    MODE = 0x54,
    SYNC = 0x58,
    OUTINIT = 0x5C,
    OUTMASK = 0x60,
    COMBINE = 0x64,
    DEADTIME = 0x68,
    EXTTRIG = 0x6C,
    POL = 0x70,
    FMS = 0x74,
    FILTER = 0x78,
    FLTCTRL = 0x7C,
    QDCTRL = 0x80,
    CONF = 0x84,
    FLTPOL = 0x88,
    SYNCONF = 0x8C,
    SWOCTRL = 0x94,
    LAST = 0x98,
    PAIR_COMBINE = 1,
    PAIR_COMP = 2,
    PAIR_DTEN = 16,
    PAIR_SYNCEN = 32,
    PAIR_FAULTEN = 64,
    SIX_OUTPUTS = 0x3F,
};

static inline const peripheral_t *ftm0(void)
{
    return PERIPHERAL(FTM0);
}

/** ftm_fault.c. A register of the fault control was written; a period of FTM0 begins. */
void ftm_fault_written(emu_t *emu, uint32_t offset, uint32_t value);
void ftm_fault_period(emu_t *emu);
uint32_t ftm_fault_status(const emu_t *emu);
/** Channels that a fault holds in their safe state. */
uint32_t ftm_fault_channels(const emu_t *emu);

/** ftm_outputs.c. Outputs 0 ... 5 that may switch on in this period. */
uint32_t ftm_driven(const emu_t *emu);
/** Stops the emulation in states that the plant cannot represent: only some outputs on, or switching enabled within a
 * period. */
void ftm_outputs_check(emu_t *emu, bool period_begins);
void ftm_outputs_written(emu_t *emu, uint32_t offset, uint32_t value);

#endif
