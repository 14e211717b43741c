/* SPDX-License-Identifier: Apache-2.0 */
#ifndef CONTROL_FLUX_TABLE_TYPES_H
#define CONTROL_FLUX_TABLE_TYPES_H
/** What the flux-table service answers for one operating point; the values other stages consume.
 * Source   docs/theory/flux-tables.md (FT-1) ... (FT-6)
 * Units    inductances per unit of 2^l_shift L_b; flux per unit of psi_b; g = omega_b T_s/l < 1: one period of full
 *          voltage must not reach I_b
 * Range    q15 in a word each: halfwords would cost an extension at every use
 * Context  values only */
#include "fx/q.h"

/** In every period. */
typedef struct {
    int32_t psi_d;    /* psi_f0 + l_d i_d, nominal magnet */
    int32_t psi_q;    /* l_q i_q */
    int32_t psi_f0;   /* psi_d at i_d = 0 for this i_q, nominal magnet */
    int32_t g;        /* (1/l_dd + 1/l_qq) omega_b T_s/2, as the observer's poles want it */
} flux_point_t;

/** For tasks. */
typedef struct {
    int32_t l_d;  /* apparent: psi_d - psi_f0 = l_d i_d */
    int32_t l_qq; /* incremental: d psi_q/d i_q */
} flux_inductances_t;

#endif
