/* SPDX-License-Identifier: Apache-2.0 */
#ifndef TYPES_OPERATING_POINT_H
#define TYPES_OPERATING_POINT_H
/** Operating point of the machine in one PWM period: input of both identifications and of the monitors.
 * Source   docs/theory/flux-tables.md (FT-1) ... (FT-6) for the flux; docs/theory/current-control.md for the voltage
 * Units    per unit of the bases in types/bases.h; g = omega_b T_s/l per unit of 2^g_shift, below 1
 * Range    each q15 field is a word, because a halfword would have to be sign-extended at every use
 * Errors   none: values only
 * Context  values only */
#include "types/frames.h"

/** Result of the flux tables at one current. */
typedef struct {
    int32_t psi_d;  /* psi_f0 + l_d i_d, nominal magnet */
    int32_t psi_q;  /* l_q i_q */
    int32_t psi_f0; /* psi_d at i_d = 0 for this i_q, nominal magnet */
    int32_t g;      /* (1/l_dd + 1/l_qq) omega_b T_s/2^(1 + g_shift), from which the observer's poles follow */
} flux_point_t;

typedef struct {
    flux_point_t flux; /* at i */
    dq_q15_t i;        /* sampled at the start of this period */
    dq_q15_t u;        /* acts during this period, in the frame of its middle */
    q31_t omega;       /* electrical speed */
} operating_point_t;

#endif
