/* SPDX-License-Identifier: Apache-2.0 */
#ifndef VECU_STAND_H
#define VECU_STAND_H
/** What surrounds the bridge, by name: battery, switches, temperatures, lines. "board.<field>"
 * Units    the names end in them
 * Errors   stand_set() false: not finite or out of range, nothing changed; stand_get() NaN: unknown name
 * Context  simulation only */
#include <stdbool.h>

#include "dc_link.h"

typedef struct {
    dc_link_params_t dc;
    double inverter_C;
    double gate_fault; /* not 0: the driver reports a fault */
} stand_t;

void stand_default(stand_t *stand, double battery_V);
bool stand_set(stand_t *stand, const char *name, double value);
double stand_get(const stand_t *stand, const char *name);
/** The names one by one, NULL after the last. */
const char *stand_name(int index);

#endif
