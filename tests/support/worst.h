/* SPDX-License-Identifier: Apache-2.0 */
#ifndef SUPPORT_WORST_H
#define SUPPORT_WORST_H
/** The largest error of a sweep. fmax() returns its other argument where one is not a number, so that a sweep in which
 * the firmware or its twin returns NaN would pass. Here NaN is worse than every number, and stays.
 * Units    those of the errors, which are magnitudes or have a sign
 * Errors   none
 * Context  tests */
#include <math.h>
#include <stdbool.h>

static inline bool is_worse(long double error, long double worst)
{
    return !isnan(worst) && !(error <= worst);
}

/** The next error, if it is worse than the worst one before it. */
static inline double worse_of(double worst, double error)
{
    return is_worse(error, worst) ? error : worst;
}

#endif
