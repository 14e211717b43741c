/* SPDX-License-Identifier: Apache-2.0 */
#ifndef CURRENT_FLUX_TABLE_H
#define CURRENT_FLUX_TABLE_H
/** Look-up of flux linkages and inductances of a saturating machine at (i_d, i_q).
 *   psi_d = l_d(i_d,|i_q|) i_d + psi_f0(|i_q|),  psi_q = l_q(i_d,|i_q|) i_q, bilinear in the tabulated quantities
 * Source   docs/theory/flux-tables.md (FT-1) ... (FT-6); the 2014 paper's look-up of L_d, L_q (section 1)
 * Units    currents per unit of I_b; results as in flux_table_types.h
 * Range    i_d, i_q anywhere in q15; outside the grid the value at its edge is used, which flux_table_outside() reports
 * Rounding 1 LSB q15 per interpolated quantity; psi: 1/2 LSB of psi_f0 and 1/2 of the product with an l of 29 bits
 * Errors   none; flux_table_check() rejects a bad table at start-up
 * Context  step: fast ISR, once per period; the others: tasks; no division, no loop */
#include <stdint.h>

#include "control/current/flux_table_types.h"
#include "fx/lookup.h"
#include "types/frames.h"
#include "types/motor_check.h"

typedef struct {
    fx_mesh_t mesh;           /* x: i_d from x0 in q15 counts, y: |i_q| from 0 */
    int32_t i_scale;          /* 8 2^l_shift: l in Q29 times i is then flux in q15 */
    const int16_t *l_d, *l_q; /* [ix * ny + iy], as all but psi_f0; neighbours are read by one instruction */
    const int16_t *psi_f0;    /* [iy]: depends on i_q alone */
    const int16_t *g, *l_qq;
    uint8_t l_shift; /* inductances are stored as l / 2^l_shift */
} flux_table_config_t;

motor_check_t flux_table_check(const flux_table_config_t *config);
flux_point_t flux_table_step(const flux_table_config_t *config, dq_q15_t i);
flux_inductances_t flux_table_inductances(const flux_table_config_t *config, dq_q15_t i);

static inline bool flux_table_outside(const flux_table_config_t *config, dq_q15_t i)
{
    return fx_mesh_outside(&config->mesh, i.d, (uint32_t)((i.q < 0) ? -i.q : i.q));
}

#endif
