/* SPDX-License-Identifier: Apache-2.0 */
/* The movement that the bus requests, in the units of the drive. */
#include "ecu/ecu_private.h"
#include "types/si.h"

static int32_t share_of_i_max(const ecu_t *ecu, int16_t permille)
{
    return fx_mul_q15(q15_from_si((float)permille, 1000.0F), ecu->drive.motor->commission.i_max);
}

movement_request_t ecu_movement(const ecu_t *ecu)
{
    if (!ecu->rx.commission_channel.alive) {
        return (movement_request_t){.alive = false}; /* the usual case: nothing is converted */
    }
    const bus_commission_t *wanted = &ecu->rx.commission;
    const ecu_state_t state = ecu->supervisor.state;
    const float torque_Nm = ecu->rx.command.torque_requested_Nm;
    const q15_t torque = q15_from_si(torque_Nm, ecu->drive.motor->bases.torque_Nm);
    const bool is_zero = fx_abs_q15(torque) <= ecu->arbitration_config.dead_band;
    return (movement_request_t){
        .movement = wanted->movement,
        .pole_pairs = wanted->pole_pairs,
        .direction = wanted->direction,
        .reversed = wanted->reversed,
        .damped = wanted->damped,
        .alive = true,
        .may_begin = is_zero && (state == STATE_STANDBY || state == STATE_READY),
        .offset = wanted->offset,
        .i = {share_of_i_max(ecu, wanted->current_d_permille), share_of_i_max(ecu, wanted->current_q_permille)},
    };
}
