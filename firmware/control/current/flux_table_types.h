/* SPDX-License-Identifier: Apache-2.0 */
#ifndef CURRENT_FLUX_TABLE_TYPES_H
#define CURRENT_FLUX_TABLE_TYPES_H
/** Result of the flux tables for one operating point.
 * Source   docs/theory/flux-tables.md (FT-1) ... (FT-6)
 * Units    inductances per unit of 2^l_shift L_b; flux per unit of psi_b; g = omega_b T_s/(2^g_shift l)
 * Range    each q15 value is a word, because a halfword would have to be sign-extended at every use
 * Errors   none: values only
 * Context  values only */
#include "types/operating_point.h"

/** For tasks. */
typedef struct {
    int32_t l_d;  /* apparent: psi_d - psi_f0 = l_d i_d */
    int32_t l_qq; /* incremental: d psi_q/d i_q */
} flux_inductances_t;

#endif
