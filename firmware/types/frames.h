/* SPDX-License-Identifier: Apache-2.0 */
#ifndef TYPES_FRAMES_H
#define TYPES_FRAMES_H
/** Vectors in the three reference frames, per unit, amplitude-invariant. The type states the fixed-point format.
 *   abc  phase quantities; ab  stationary (alpha along phase a); dq  rotor frame (d along the magnet)
 *   qN   value = integer / 2^N
 * Source   docs/theory/current-control.md (CC-1)
 * Units    per unit of the bases in types/bases.h
 * Range    a measured or applied vector stays inside [-1, 1): the over-current trip and the voltage circle keep its
 *          magnitude below 1. Sums over several periods and limits that are not yet applied may exceed 1; every
 *          component is a word, so that they fit and no halfword has to be sign-extended.
 * Errors   none: values only
 * Context  values only, passed by copy; a component never changes its format without changing the type */
#include "fx/q.h"

/* In a scale that its user states. */
typedef struct {
    int32_t a, b, c;
} abc_t;

typedef struct {
    int32_t a, b, c;
} abc_q15_t;

typedef struct {
    int32_t a, b, c;
} abc_q29_t;

typedef struct {
    int32_t alpha, beta;
} ab_q15_t;

typedef struct {
    int32_t alpha, beta;
} ab_q30_t;

typedef struct {
    int32_t d, q;
} dq_q15_t;

typedef struct {
    int32_t d, q;
} dq_q22_t;

typedef struct {
    int32_t d, q;
} dq_q27_t;

typedef struct {
    int32_t d, q;
} dq_q28_t;

typedef struct {
    int32_t d, q;
} dq_q29_t;

typedef struct {
    int32_t d, q;
} dq_q30_t;

typedef struct {
    q31_t d, q;
} dq_q31_t;

/** The same as dq_q15_t in half of the memory, for vectors that are stored longer than they are computed with. */
typedef struct {
    q15_t d, q;
} dq_q15_halfword_t;

#endif
