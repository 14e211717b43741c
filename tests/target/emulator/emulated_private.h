/* SPDX-License-Identifier: Apache-2.0 */
#ifndef EMULATOR_EMULATED_PRIVATE_H
#define EMULATOR_EMULATED_PRIVATE_H
/** Types and functions that the emulated controller and its shadow on the host share.
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
    double known_share; /* what the converters read of the bandgap; 1: right */
    bool board;         /* the image's outputs control contactor, precharge, discharge and gate-driver supply */
    fluxtrue_t *shadow; /* NULL: there is none */
    uint32_t temperature_steps_at; /* of hal/s32k144/temperature.c, in the image */
    drive_t task_result;           /* result of the shadow's task, while the image's task still runs */
    bool task_runs;
    uint32_t reset_cause; /* of a reset that is to come in the next period, 0: none */
    double reset_share;   /* of that period */
    uint32_t resets_seen;
    bool lost;       /* the processor was reset in this period */
    bool gate_fault; /* the fault interrupt has run; the shadow's next fast ISR raises the fault */
    uint64_t compared, differing;
    char difference[96];
} emulated_t;

double emulated_get(emulated_t *e, const char *name);

/** Gives a drive on the host the temperatures that the image computes from the thermistors. */
void temperatures_take(const emulated_t *e, fluxtrue_t *host);

bool shadow_start(emulated_t *e);
void shadow_inputs(emulated_t *e);
void shadow_compare(emulated_t *e);

#endif
