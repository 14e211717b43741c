/* SPDX-License-Identifier: Apache-2.0 */
#ifndef TORQUE_CURRENT_REFERENCE_H
#define TORQUE_CURRENT_REFERENCE_H
/** Current references: maximum torque per ampere, field weakening and maximum torque per volt from one table.
 *   (i_d, i_q) = table(|T|, psi_plan), i_q takes the sign of T
 *   psi_plan = (v_ratio v_dc - r |i| + v_trim)/|w| - shift, with shift the contribution of the identified flux error to
 *     |psi|, and v_trim the output of voltage_reserve.h
 *   |T| is first limited to t_max(psi_plan), the largest torque inside voltage and current circle; i_d is limited to
 *     -i_d_max.
 *   torque_max = t_max + dpsi_d i_q(t_max) - dpsi_q i_d(t_max): the largest torque of the machine as identified; here
 *     t_max does not count additional flux from a weak magnet
 * Source   docs/theory/current-reference.md (CR-1) ... (CR-11)
 * Units    per unit
 * Range    psi_plan outside the grid uses the edge: above it is maximum torque per ampere, below it is flagged;
 *          |v_trim|, |shift| < 1/2
 * Rounding 1 LSB q15 of interpolation
 * Errors   limited: the torque was limited by voltage or current; i_d_limited: i_d was limited
 * Context  1 kHz task; one bounded division */
#include <stdbool.h>

#include "fx/lookup.h"
#include "types/frames.h"
#include "types/motor_check.h"

typedef struct {
    fx_grid_t grid;       /* x: |T| from 0, y: psi_avail from y0, both q15 */
    const int16_t *i_d;   /* [ix * ny + iy], <= 0 */
    const int16_t *i_q;   /* [ix * ny + iy], >= 0 */
    fx_lut1_t torque_max; /* over psi_avail */
    q15_t v_ratio;        /* planned share of v_dc: a little below current control's, as its dynamic reserve */
    q16_t r_pu;
    q15_t i_max; /* current circle */
} current_reference_config_t;

/** q15 in words, which are loaded without a sign extension. */
typedef struct {
    int32_t torque_corrected;
    int32_t v_dc;
    int32_t omega;
    int32_t i_magnitude; /* |i_ref| of the last step: the resistive drop */
    int32_t v_trim;
    int32_t shift;
    int32_t psi_d_error; /* identified flux minus the table's, d axis */
    int32_t i_d_max;     /* magnitude of the demagnetisation limit at the present temperature */
    int32_t psi_q_delta; /* identified |psi_q| minus the tables', at the last reference */
} current_reference_in_t;

typedef struct {
    dq_q15_t i_ref;
    q15_t torque_max; /* largest torque of the machine as identified */
    q15_t psi_plan;   /* planned flux: second input of the table */
    bool limited;
    bool i_d_limited;
} current_reference_t;

motor_check_t current_reference_check(const current_reference_config_t *config);
current_reference_t current_reference_step(const current_reference_config_t *config, const current_reference_in_t *in);

#endif
