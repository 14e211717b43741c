/* SPDX-License-Identifier: Apache-2.0 */
#ifndef TYPES_SI_H
#define TYPES_SI_H
/** Per unit to SI and back.
 *   SI = x base,  x = SI/base, with x = count/2^15 (q15) or count/2^31 (q31)
 * Source   docs/scaling.md (SC-1) ... (SC-5)
 * Units    those of the base: see bases.h
 * Range    to SI: every count; from SI: every number, saturated at the largest count beyond one per unit
 * Rounding single precision; to the nearest count, halves away from zero
 * Errors   NaN must have been refused before: it becomes the most negative count
 * Context  1 kHz task and below it in priority; floating point, hence in no interrupt above it */
#include "fx/format.h"

float si_from_q15(int32_t x, float base);
float si_from_q31(int32_t x, float base);
q15_t q15_from_si(float value, float base);
q31_t q31_from_si(float value, float base);

#endif
