/* SPDX-License-Identifier: Apache-2.0 */
#ifndef CONTROL_CURRENT_REFERENCE_H
#define CONTROL_CURRENT_REFERENCE_H
/** Current references: maximum torque per ampere, field weakening and maximum torque per volt from one table.
 *   (i_d, i_q) = table(|T|, psi_avail), i_q takes the sign of T;  psi_avail = (v_ratio v_dc - r |i|)/|w|
 *   |T| is first limited to t_max(psi_avail), the largest torque inside voltage and current circle.
 * Source   docs/theory/current-reference.md (CR-1) ... (CR-8)
 * Units    per unit
 * Range    psi_avail outside the grid uses the edge: above it is maximum torque per ampere, below it is flagged
 * Rounding 1 LSB q15 of interpolation
 * Errors   limited: the torque was cut, by voltage or by current
 * Context  1 kHz task; one bounded division */
#include <stdbool.h>

#include "fx/lookup.h"
#include "types/frames.h"

typedef struct {
    fx_grid_t grid;         /* x: |T| from 0, y: psi_avail from y0, both q15 */
    const int16_t *i_d;     /* [ix * ny + iy], <= 0 */
    const int16_t *i_q;     /* [ix * ny + iy], >= 0 */
    fx_lut1_t torque_max;   /* over psi_avail */
    q15_t v_ratio;          /* planned share of v_dc: a little below current control's, as its dynamic reserve */
    q16_t r_pu;
    q15_t i_max;            /* current circle */
} current_reference_config_t;

typedef struct {
    q15_t torque;
    q15_t v_dc;
    q15_t omega;
    q15_t i_magnitude; /* |i_ref| of the last step: the resistive drop */
} current_reference_in_t;

typedef struct {
    dq_t i_ref;
    q15_t torque_max;  /* at this available flux */
    bool limited;
} current_reference_t;

bool current_reference_valid(const current_reference_config_t *config);
current_reference_t current_reference_step(const current_reference_config_t *config, const current_reference_in_t *in);

#endif
