/* SPDX-License-Identifier: Apache-2.0 */
#ifndef VECU_STAND_H
#define VECU_STAND_H
/** Inputs of the board, by name: temperatures and lines as "board.<field>". Battery, capacitor and switches belong to
 * the plant.
 * Units    at the end of each name
 * Errors   stand_set() false: not finite or out of range, nothing changed; stand_get() NaN: unknown name
 * Context  simulation only */
#include <stdbool.h>

#include "loop/runner/sim.h"

typedef struct {
    double inverter_C;
    double gate_fault;                                            /* not 0: the driver reports a fault */
    double angle_unknown;                                         /* not 0: an encoder before its index */
    double gates_stuck, supply_stuck, watchdog_stuck, task_stuck; /* not 0: defective; hal/host/instance.h */
} stand_t;

void stand_default(stand_t *stand);
/** Gives the plant a dc-link capacitor, empty at the start; before sim_start(). False: the plant refuses it. */
bool stand_dc_link(sim_t *sim);
bool stand_set(stand_t *stand, const char *name, double value);
double stand_get(const stand_t *stand, const char *name);
/** The name with this index; NULL after the last. */
const char *stand_name(int index);

#endif
