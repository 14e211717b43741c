/* SPDX-License-Identifier: Apache-2.0 */
#ifndef FX_VEC_H
#define FX_VEC_H

/** Length of a vector, |v| = sqrt(x^2 + y^2), and its other component, sqrt(length^2 - x^2).
 * Source   docs/theory/fixed-point.md (FX-21)
 * Units    per unit, q15
 * Range    every argument; lengths of 1 and more saturate to Q15_MAX
 * Rounding 0.69 LSB
 * Errors   none
 * Context  any; 24 instructions as a call */

#include "fx/q.h"

q15_t fx_magnitude(q15_t x, q15_t y);

/* sqrt(length^2 - x^2); 0 if |x| exceeds the length. */
q15_t fx_leg(q15_t length, q15_t x);

#endif
