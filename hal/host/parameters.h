/* SPDX-License-Identifier: Apache-2.0 */
#ifndef HAL_HOST_PARAMETERS_H
#define HAL_HOST_PARAMETERS_H
/** The names of fluxtrue_set() and fluxtrue_get() by their handles: what may be set, and to what.
 * Source   docs/howto/software-in-the-loop.md
 * Units    SI
 * Context  private to hal/host, between two periods */
#include <stdbool.h>

#include "hal/host/fluxtrue.h"

typedef struct {
    const char *name;
    double (*get)(const fluxtrue_t *drive);
    void (*set)(fluxtrue_t *drive, double value); /* NULL: read only */
    double lo, hi;                                /* infinite: the motor's limit of torque or current */
} parameter_t;

/** The names before those of the calibration values. */
extern const parameter_t parameters[];
extern const int parameters_count;

typedef struct {
    double lo, hi;
    double least; /* 0, or the smallest value besides 0 that is accepted */
} parameters_range_t;

/** False also for a handle that does not exist. */
bool parameters_writable(int handle);
/** Of a name that is writable. */
parameters_range_t parameters_range(const fluxtrue_t *drive, int handle);
/** The code that fluxtrue_set_by() would answer. */
int parameters_check(const fluxtrue_t *drive, int handle, double value);

#endif
