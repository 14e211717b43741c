/* SPDX-License-Identifier: Apache-2.0 */
#ifndef TWIN_TRIM_H
#define TWIN_TRIM_H
/** The dead-time compensation that follows what is identified, in doubles, from docs/theory/dead-time-trim.md.
 * Units    drop and v_dc in one unit of voltage; base and trim are shares of the period
 * Context  tests on a host */

typedef struct {
    double base, trim;
} twin_trim_t;

/* After one second of identification; returns what is left of the drop. */
double twin_trim(twin_trim_t *state, double drop, double v_dc);

#endif
