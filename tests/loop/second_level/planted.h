/* SPDX-License-Identifier: Apache-2.0 */
#ifndef LOOP_SECOND_LEVEL_PLANTED_H
#define LOOP_SECOND_LEVEL_PLANTED_H
/** Software errors of the first level, planted one at a time: in the RAM copy of its motor data, or by functions that
 * the linker puts in place of its own (--wrap). The code under test is otherwise the unchanged firmware.
 * Context  test only */
#include "vehicle.h"

typedef struct {
    const char *name;
    void (*damage)(vehicle_t *vehicle); /* called once, when the error begins; NULL: only wrapped functions change */
} planted_t;

extern const planted_t planted_errors[];
extern const int planted_count;

/** Makes the error with this index active from now on; -1: none. */
void planted_begin(int index, vehicle_t *vehicle);

#endif
