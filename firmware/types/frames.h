/* SPDX-License-Identifier: Apache-2.0 */
#ifndef TYPES_FRAMES_H
#define TYPES_FRAMES_H
/** Vectors in the three reference frames, per unit, amplitude-invariant.
 *   abc  phase quantities; ab  stationary (alpha along phase a); dq  rotor frame (d along the magnet)
 * Source   docs/theory/current-control.md (CC-1)
 * Units    per unit of the bases in types/bases.h
 * Range    [-1, 1) each; a vector's magnitude is kept below 1 by the over-current trip and the voltage circle
 *          q15 in a word each: a halfword would cost a sign extension at every use
 * Context  values only, passed by copy */
#include "fx/q.h"

typedef struct {
    int32_t a, b, c;
} abc_t;

typedef struct {
    int32_t alpha, beta;
} ab_t;

typedef struct {
    int32_t d, q;
} dq_t;

#endif
