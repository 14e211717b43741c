/* SPDX-License-Identifier: Apache-2.0 */
#ifndef TWIN_TRIM_H
#define TWIN_TRIM_H
/** Dead-time trim in doubles, from docs/theory/dead-time-trim.md: moves the identified voltage drop into the dead-time
 * compensation.
 * Units    drop and v_dc in the same unit of voltage; base and trim are shares of the period
 * Context  tests on a host */

typedef struct {
    double base, trim;
} twin_trim_t;

/* To be called after each second of identification; returns the remaining drop. */
double twin_trim(twin_trim_t *state, double drop, double v_dc);

#endif
