/* SPDX-License-Identifier: Apache-2.0 */
#ifndef FX_CIRCLE_H
#define FX_CIRCLE_H

/** The other leg of a right triangle with the hypotenuse 1, never below a quarter.
 *   y[n] = max(sqrt(1 - ((n + 1)/256)^2), 1/4): the smallest value in the cell n/256 <= |x| < (n + 1)/256
 * Source   docs/theory/fixed-point.md (FX-27)
 * Units    q15
 * Range    n = 0 ... 255
 * Rounding down, to the value at the cell's end: by at most 0.0149 where y reaches a quarter, 0.004 at |x| = 0.7
 * Errors   none
 * Context  any; one load */

#include <stdint.h>

extern const uint16_t fx_circle_table[256];

#endif
