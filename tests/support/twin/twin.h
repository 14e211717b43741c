/* SPDX-License-Identifier: Apache-2.0 */
#ifndef TWIN_H
#define TWIN_H
/** The whole controller in SI doubles; called in the same way as the software-in-the-loop library.
 *   One call to twin_step() is one PWM period: samples at its start in, duties for the next period out.
 * Source   docs/theory; the stages are in twin_stages.h
 * Units    SI; names end in their unit
 * Errors   twin_set(): 0, -1 unknown name, -2 out of range, -3 read only; twin_get(): NaN for an unknown name
 * Context  tests and simulation on a host; any number of instances */
#include "twin/twin_stages.h"

enum { TWIN_OK = 0, TWIN_UNKNOWN_NAME = -1, TWIN_OUT_OF_RANGE = -2, TWIN_READ_ONLY = -3 };

typedef struct twin twin_t;

twin_t *twin_create(void);
void twin_destroy(twin_t *twin);
int twin_set(twin_t *twin, const char *name, double value);
double twin_get(const twin_t *twin, const char *name);
/* in: ia_A ib_A ic_A vdc_V theta_m_rad t_winding_C; out: duty_a duty_b duty_c gates_on. */
void twin_step(twin_t *twin, const double in[6], double out[4]);

#endif
