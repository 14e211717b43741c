/* SPDX-License-Identifier: Apache-2.0 */
#ifndef HAL_HOST_PER_UNIT_H
#define HAL_HOST_PER_UNIT_H
/** Per unit to SI and back, in double precision for the interface of the library; the firmware has types/si.h.
 *   SI = x base,  x = SI/base, with x = count/2^15 (q15) or count/2^31 (q31)
 * Source   docs/scaling.md (SC-1) ... (SC-5)
 * Units    those of the base: see bases.h
 * Range    to SI: every count; from SI: every number, saturated at the largest count beyond one per unit
 * Rounding to the nearest count, halves to the even one
 * Errors   NaN must have been refused before
 * Context  any */
#include <math.h>

#include "fx/format.h"

static inline double per_unit_si_from_q15(int32_t x, double base)
{
    return x / 32768.0 * base;
}

static inline double per_unit_si_from_q31(q31_t x, double base)
{
    return x / 2147483648.0 * base;
}

static inline q15_t per_unit_q15_from_si(double value, double base)
{
    return fx_sat_q15((int32_t)lrint(fmin(fmax(value / base, -1.0), 1.0) * 32768.0));
}

#endif
