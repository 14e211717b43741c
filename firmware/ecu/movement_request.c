/* SPDX-License-Identifier: Apache-2.0 */
/* What the bus requests and agrees to for commissioning: a movement, in the units of the drive, and voltage pulses. */
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
    const bool is_zero = fx_abs_q15(ecu->commanded.torque_requested) <= ecu->arbitration_config.dead_band;
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

/* Between standby and derate, with the dc link charged or being charged: a consent given in standby lasts up to run. */
static bool may_last(ecu_state_t state)
{
    return state >= STATE_STANDBY && state <= STATE_DERATE;
}

/* Like a movement, a consent begins only where switching is disabled and no torque is requested. It needs a change of
 * the signal: after a time-out or a fault a sender that has not noticed it must not agree anew. */
static bool agrees_to_pulses(ecu_t *ecu, const movement_request_t *movement)
{
    const bool asks = ecu->rx.commission.pulses;
    const bool begins = movement->may_begin && !ecu->pulses_asked;
    if (movement->alive) {
        ecu->pulses_asked = asks;
    }
    return movement->alive && asks && may_last(ecu->supervisor.state) && (begins || ecu->drive.request.pulses_agreed);
}

void ecu_request_commissioning(ecu_t *ecu)
{
    request_t *request = &ecu->drive.request;
    request->movement = ecu_movement(ecu);
    request->pulses_agreed = agrees_to_pulses(ecu, &request->movement);
}
