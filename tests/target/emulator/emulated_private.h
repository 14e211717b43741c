/* SPDX-License-Identifier: Apache-2.0 */
#ifndef EMULATOR_EMULATED_PRIVATE_H
#define EMULATOR_EMULATED_PRIVATE_H
/** What the emulated controller and its shadow on the host share.
 * Context  emulator only */
#include "emu.h"
#include "mirror.h"

typedef struct {
    emu_t *emu;
    mirror_t mirror;
    emu_pins_t pins_of_board; /* only the lines that scenarios set */
    double period_ticks;
    uint64_t steps;
    double inverter_C, processor_C;
    bool board;          /* the image's lines act: contactor, precharge, discharge, supply of the gates */
    fluxtrue_t *shadow;  /* NULL: not followed */
    drive_t task_result; /* of the shadow's task, while the image is still at it */
    bool task_runs;
    bool gate_fault; /* its interrupt has come, the next fast ISR tells the shadow */
    uint64_t compared, differing;
    char difference[96];
} emulated_t;

double emulated_get(emulated_t *e, const char *name);

/** What the image makes of the thermistors, for a drive on the host. */
void temperatures_take(const emulated_t *e, fluxtrue_t *host);

bool shadow_start(emulated_t *e);
void shadow_inputs(emulated_t *e);
void shadow_compare(emulated_t *e);

#endif
