/* SPDX-License-Identifier: Apache-2.0 */
#ifndef TORQUE_CURRENT_REFERENCE_H
#define TORQUE_CURRENT_REFERENCE_H
/** Current references: maximum torque per ampere, field weakening and maximum torque per volt from one table.
 *   (i_d, i_q) = table(|T|, psi_plan), i_q takes the sign of T
 *   psi_plan = sqrt(v_plan^2 - 2 r |w| T)/|w| - shift with T > 0 where the torque drives and 0 where it brakes, and
 *     shift the contribution of the identified flux error to |psi|
 *   |T| is first limited to t_max, the largest torque inside voltage and current circle: t_max(psi_plan(torque_limit));
 *     torque_limit approaches torque_max by a quarter of the difference in each step. i_d is limited to -i_d_max.
 *   torque_max = t_max + dpsi_d i_q(t_max) - dpsi_q i_d(t_max): the largest torque of the machine as identified; here
 *     t_max does not count additional flux from a weak magnet
 * Source   docs/theory/current-reference.md (CR-1) ... (CR-11), (CR-16)
 * Units    per unit
 * Range    psi_plan outside the grid uses the edge: above it is maximum torque per ampere, below it is flagged;
 *          torque_limit starts at the largest torque, so that the first steps plan too little rather than too much
 * Rounding 1 LSB q15 of interpolation; 0.7 LSB/|w| in psi_plan; torque_limit ends up to 3 LSB below torque_max
 * Errors   limited: the torque was limited by voltage or current; i_d_limited: i_d was limited
 * Context  1 kHz task; three square roots and two bounded divisions */
#include <stdbool.h>

#include "fx/lookup.h"
#include "types/frames.h"
#include "types/motor_check.h"

typedef struct {
    fx_grid_t grid;            /* x: |T| from 0, y: psi_avail from y0, both q15 */
    const int16_t *i_d;        /* [ix * ny + iy], <= 0 */
    const int16_t *i_q;        /* [ix * ny + iy], >= 0 */
    const int16_t *torque_max; /* [iy] */
    uint16_t r_q16;            /* stator resistance */
    q15_t i_max;               /* current circle */
} current_reference_config_t;

/** q15 in words, which are loaded without a sign extension. */
typedef struct {
    int32_t torque_corrected;
    int32_t v_plan; /* of voltage_reserve.h */
    int32_t omega;
    int32_t torque_limit; /* of the last step */
    int32_t shift;
    int32_t psi_d_error; /* identified flux minus the table's, d axis */
    int32_t i_d_max;     /* magnitude of the demagnetisation limit at the present temperature */
    int32_t psi_q_delta; /* identified |psi_q| minus the tables', at the last reference */
} current_reference_in_t;

typedef struct {
    dq_q15_t i_ref;
    q15_t torque_max;   /* largest torque of the machine as identified */
    q15_t torque_limit; /* follows torque_max, whose resistive drop reduces it */
    q15_t psi_plan;     /* planned flux: second input of the table */
    bool limited;
    bool i_d_limited;
} current_reference_t;

/** Before the first step: the machine's largest torque and no limit of the flux. */
static inline current_reference_t current_reference_start(q15_t torque_max)
{
    return (current_reference_t){.torque_max = torque_max, .torque_limit = torque_max, .psi_plan = Q15_MAX};
}

motor_check_t current_reference_check(const current_reference_config_t *config);
current_reference_t current_reference_step(const current_reference_config_t *config, const current_reference_in_t *in);

#endif
