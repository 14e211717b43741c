/* SPDX-License-Identifier: Apache-2.0 */
#ifndef VECU_STAND_H
#define VECU_STAND_H
/** What surrounds the bridge, by name: temperatures and lines as "board.<field>". Battery, capacitor and switches are
 * the plant's.
 * Units    the names end in them
 * Errors   stand_set() false: not finite or out of range, nothing changed; stand_get() NaN: unknown name
 * Context  simulation only */
#include <stdbool.h>

#include "loop/runner/sim.h"

typedef struct {
    double inverter_C;
    double gate_fault; /* not 0: the driver reports a fault */
} stand_t;

void stand_default(stand_t *stand);
/** The dc link's capacitor, empty: before sim_start(); false: the plant refuses it. */
bool stand_dc_link(sim_t *sim);
bool stand_set(stand_t *stand, const char *name, double value);
double stand_get(const stand_t *stand, const char *name);
/** The names one by one, NULL after the last. */
const char *stand_name(int index);

#endif
