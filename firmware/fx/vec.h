/* SPDX-License-Identifier: Apache-2.0 */
#ifndef FX_VEC_H
#define FX_VEC_H

/** Length of a vector, |v| = sqrt(x^2 + y^2), and the root of other sums and differences of squares, fx_root: a q30
 * of [0, 4), of which 1 and more give Q15_MAX.
 * Source   docs/theory/fixed-point.md (FX-21)
 * Units    per unit, q15
 * Range    every q15 argument, which may come in a word: only its lower half counts; lengths of 1 and more saturate to
 *          Q15_MAX
 * Rounding 0.69 LSB
 * Errors   none
 * Context  any; 24 instructions as a call */

#include "fx/q.h"

q15_t fx_magnitude(int32_t x, int32_t y);

/* Not inlined: one copy takes less memory. */
q15_t fx_root(uint32_t q30);

#endif
